"""The one door to heyoka, the library behind the extra `modes`."""

from legbench.analytic.equations import Ops
from legbench.errors import MissingExtraError

try:
    import heyoka
except ImportError as error:
    raise MissingExtraError(
        "heyoka is not installed; the fast path needs it: pip install 'legbench[modes]'"
    ) from error

SYMBOLS = Ops(sin=heyoka.sin, cos=heyoka.cos, sqrt=heyoka.sqrt)

__all__ = ["SYMBOLS", "heyoka"]
