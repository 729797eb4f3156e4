"""Import of submitit, an optional dependency that speaks to Slurm."""

from legbench.errors import MissingExtraError

try:
    from submitit import AutoExecutor
    from submitit.core.utils import FailedJobError, FailedSubmissionError, UncompletedJobError
except ImportError as error:
    raise MissingExtraError(
        "submitit is not installed; this executor needs it: pip install 'legbench[slurm]'"
    ) from error

__all__ = ["AutoExecutor", "FailedJobError", "FailedSubmissionError", "UncompletedJobError"]
