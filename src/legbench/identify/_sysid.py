"""The one door to `mujoco.sysid`, which needs packages that MuJoCo does not bring by itself."""

from importlib import import_module
from typing import Any

from legbench.errors import MissingExtraError


def load_sysid() -> Any:
    """Return the module `mujoco.sysid`.

    Raises:
        MissingExtraError: it is not there, or lacks what it needs.
    """
    try:
        # A module that lacks its dependencies imports as an empty one.
        import_module("mujoco.sysid._src.optimize")
        return import_module("mujoco.sysid")
    except ImportError as error:
        raise MissingExtraError(
            "mujoco.sysid is not installed; the peer needs it: pip install 'legbench[sysid]'"
        ) from error
