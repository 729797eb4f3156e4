"""What is wrong when nobody answers the first question: often the bitrate."""

from collections.abc import Iterator
from contextlib import contextmanager

from legbench.drives.errors import BusError, NoAnswerError
from legbench.drives.master.port import Port
from legbench.drives.setup.config import BusConfig


@contextmanager
def first_contact(port: Port, config: BusConfig) -> Iterator[None]:
    """Say more of a bus that fails, and of a drive that keeps silent, than that it does.

    Raises:
        BusError: the bus fails, or carries error frames only.
        NoAnswerError: a drive does not answer.
    """
    try:
        yield
    except (BusError, NoAnswerError) as error:
        if port.error_frames or port.off_bus:
            who = f"{error}; " if isinstance(error, NoAnswerError) else ""
            where = f"{who}{port.bus.channel_info}"
            off = ", the controller has gone bus-off" if port.off_bus else ""
            raise BusError(
                f"{where}: {port.error_frames} error frames and no answer{off}; another bitrate "
                f"than the drives', or a fault of the wiring: {config.bitrate_text}"
            ) from error
        if isinstance(error, NoAnswerError):
            raise NoAnswerError(f"{error}; {config.bitrate_text}") from error
        raise
