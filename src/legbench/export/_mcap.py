"""Import of mcap, an optional dependency: every other module imports it from here."""

from legbench.errors import MissingExtraError

try:
    from mcap.writer import Writer
except ImportError as error:
    raise MissingExtraError(
        "mcap is not installed; --mcap needs it: pip install 'legbench[mcap]'"
    ) from error

__all__ = ["Writer"]
