"""The one door to rerun."""

from legbench.errors import MissingExtraError

try:
    import rerun as rr
    import rerun.blueprint as rrb
except ImportError as error:
    raise MissingExtraError(
        "rerun is not installed; the viewer needs it: pip install 'legbench[viz]'"
    ) from error

__all__ = ["rr", "rrb"]
