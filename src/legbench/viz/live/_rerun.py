"""Import of rerun, an optional dependency: every other module imports it from here."""

from legbench.errors import MissingExtraError

try:
    import rerun as rr
    import rerun.blueprint as rrb
except ImportError as error:
    raise MissingExtraError(
        "rerun is not installed; the viewer needs it: pip install 'legbench[viz]'"
    ) from error

__all__ = ["rr", "rrb"]
