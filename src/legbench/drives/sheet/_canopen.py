"""The one door to canopen, the library behind the extra `eds`."""

from legbench.errors import MissingExtraError

try:
    from canopen.objectdictionary import ODVariable, import_od
except ImportError as error:
    raise MissingExtraError(
        "canopen is not installed; reading a data sheet needs it: pip install 'legbench[eds]'"
    ) from error

__all__ = ["ODVariable", "import_od"]
