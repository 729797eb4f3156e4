"""The error tree: every error also subclasses the built-in it resembles.

A message says the value, the limit, the unit and the way out. The command line turns any
`LegbenchError` into one line on stderr and a non-zero exit status.
"""


class LegbenchError(Exception):
    """Base of everything that legbench raises on purpose."""


class DesignError(LegbenchError, ValueError):
    """Error of a design file or a parameter set that no leg can have."""


class ConfigError(LegbenchError, ValueError):
    """Error of a setting that the chosen design, setup or controller refuses."""


class UnwritableError(ConfigError):
    """Error of a file or folder that was named for results and cannot be written."""


class RecordingError(LegbenchError, OSError):
    """Error of a run folder that cannot be written, read or repaired."""


class FormatError(RecordingError):
    """Error of a run folder in a format that this version does not know."""


class MissingExtraError(LegbenchError, ImportError):
    """Error of an optional package or a display that a command needs and that is not there."""


class PlantFault(LegbenchError, RuntimeError):
    """Fault of a plant that cannot go on: the run ends, the cause is kept, the recording survives.

    Attributes:
        cause: a short name of the fault, as written into the run's manifest.
    """

    def __init__(self, cause: str, message: str) -> None:
        super().__init__(message)
        self.cause = cause

    def __reduce__(self) -> tuple[type["PlantFault"], tuple[str, str]]:
        return type(self), (self.cause, str(self))


class CampaignError(LegbenchError, RuntimeError):
    """Error of a campaign that cannot begin or come to its end; what is done by then is kept."""
