"""What drives and buses refuse, below the common error tree."""

from legbench.errors import LegbenchError


class DriveError(LegbenchError, RuntimeError):
    """A drive that is missing, is another one, or does not do what it was told."""


class NoAnswerError(DriveError):
    """A node that keeps silent when it is asked for an object."""


class StopError(DriveError):
    """Drives that keep their power after a stop, or no longer answer whether they do."""


class BusError(LegbenchError, OSError):
    """A CAN interface that is not there, is down, is taken, or has left the bus."""


class CodecError(DriveError, ValueError):
    """Bytes that do not mean what they should; nothing was changed by them."""


class SdoAbortError(DriveError):
    """An SDO transfer that one side has ended (CiA 301, 7.2.4.3.17).

    Attributes:
        code: the abort code.
        index: index of the object.
        sub: sub-index of the object.
    """

    def __init__(self, code: int, index: int, sub: int, meaning: str) -> None:
        super().__init__(f"object {index:04X}h:{sub:02X}: {meaning} (abort {code:08X}h)")
        self.code, self.index, self.sub = code, index, sub
        self._meaning = meaning

    def __reduce__(self) -> tuple[type["SdoAbortError"], tuple[int, int, int, str]]:
        return type(self), (self.code, self.index, self.sub, self._meaning)
