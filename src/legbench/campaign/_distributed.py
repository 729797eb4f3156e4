"""Import of Dask's scheduler, an optional dependency."""

from legbench.errors import MissingExtraError

try:
    from dask.config import set as configured
    from distributed import Client, KilledWorker, LocalCluster
except ImportError as error:
    raise MissingExtraError(
        "dask is not installed; this executor needs it: pip install 'legbench[dask]'"
    ) from error

__all__ = ["Client", "KilledWorker", "LocalCluster", "configured"]
