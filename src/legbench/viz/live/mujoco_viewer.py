"""MuJoCo's own viewer, to look at a model and pull at it."""

import mujoco

from legbench.errors import ConfigError, MissingExtraError
from legbench.viz.display import has_display

try:
    import mujoco.viewer
except ImportError as error:
    raise MissingExtraError(
        "glfw is not installed; MuJoCo's viewer needs it: pip install 'legbench[render]'"
    ) from error


def view_model(xml: str) -> None:
    """Show a model in a window until it is closed.

    Raises:
        MissingExtraError: there is no display.
        ConfigError: MuJoCo refuses the model.
    """
    if not has_display():
        raise MissingExtraError(
            "no display: write the model with --out FILE and open it on a machine that has one"
        )
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise ConfigError(f"MuJoCo refuses the model: {error}") from error
    mujoco.viewer.launch(model)
