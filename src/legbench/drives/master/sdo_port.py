"""Objects of one drive over a port: blocking, with time-outs and retries; not for the cycle."""

from collections.abc import Callable
from typing import TypeVar, final

import can

from legbench.drives.errors import CodecError, DriveError, NoAnswerError, SdoAbortError
from legbench.drives.master.port import Port
from legbench.drives.protocol.datatypes import (
    DataType,
    Value,
    fitting_type,
    pack,
    size_of,
)
from legbench.drives.protocol.frame import SDO_REPLY_BASE, SDO_REQUEST_BASE
from legbench.drives.protocol.objects import name_of
from legbench.drives.protocol.sdo import LENGTHS, Abort, abort_data
from legbench.drives.protocol.sdo_client import Download, Progress, Upload

Carried = TypeVar("Carried", Upload, Download)


def _ignore(_message: can.Message) -> None:
    """Discard a frame that is not an answer."""


def _nothing() -> None:
    """Do nothing before a write."""


@final
class SdoPort:
    """Reads and writes the object dictionary of one node."""

    def __init__(
        self,
        port: Port,
        node_id: int,
        *,
        timeout_ms: int = 200,
        retries: int = 3,
        on_other: Callable[[can.Message], None] = _ignore,
        before_write: Callable[[], None] = _nothing,
    ) -> None:
        self._port, self.node_id = port, node_id
        self._timeout_ns, self._retries = 1_000_000 * timeout_ms, retries
        self._timeout_ms = timeout_ms
        self._on_other, self._before_write = on_other, before_write

    def read(self, index: int, sub: int = 0) -> bytes:
        """Bytes of an object.

        Raises:
            SdoAbortError: the drive refuses.
            NoAnswerError: it does not answer.
            BusError: the bus does not work.
        """
        return self._upload(index, sub).result

    def write(self, index: int, sub: int, content: bytes) -> None:
        """Write the bytes of an object; raises as `read` does."""
        self._transfer(lambda: Download(index, sub, content), index, sub)

    def get(self, index: int, sub: int, kind: DataType) -> Value:
        """Value of an object; raises as `read` does, and DriveError for another type."""
        return self._decoded(self._upload(index, sub).value, index, sub, kind)

    def get_int(self, index: int, sub: int, kind: DataType) -> int:
        """Value of a whole number, in the drive's own length; raises as `get` does."""
        return self._whole(self._upload(index, sub).widened, index, sub, kind)

    def get_certain(self, index: int, sub: int, kind: DataType) -> int:
        """Value of a whole number that a protection depends on.

        Raises as `get_int` does, and DriveError for a shorter number that may be negative as well.
        """
        return self._whole(self._upload(index, sub).certain, index, sub, kind)

    def get_number(self, index: int, sub: int, kind: DataType) -> float:
        """Value of an object that is a number of any kind; raises as `get` does."""
        value = self.get(index, sub, kind)
        if not isinstance(value, int | float):
            raise DriveError(f"node {self.node_id}, {name_of(index, sub)} is no number")
        return value

    def find_int(self, index: int, sub: int, kind: DataType) -> int | None:
        """Value of a numeric object that a drive may do without; none where it cannot be read.

        Raises:
            NoAnswerError: the drive does not answer.
            BusError: the bus does not work.
            DriveError: the object has another type.
        """
        try:
            return self.get_int(index, sub, kind)
        except SdoAbortError:
            return None

    def put(self, index: int, sub: int, kind: DataType, value: int) -> None:
        """Write the value of an object, in the drive's own length if it has another one.

        Raises as `read` does, also where the value does not fit that length.
        """
        try:
            self.write(index, sub, pack(kind, value))
        except SdoAbortError as error:
            length = self._own_length(index, sub) if error.code in LENGTHS else size_of(kind)
            own = None if length == size_of(kind) else fitting_type(kind, length or 0, value)
            if own is None:
                raise
            self.write(index, sub, pack(own, value))

    def _own_length(self, index: int, sub: int) -> int | None:
        """Length that the drive answers with [bytes]; none if it refuses."""
        try:
            return len(self.read(index, sub))
        except SdoAbortError:
            return None

    def _whole(
        self, decode: Callable[[DataType], Value], index: int, sub: int, kind: DataType
    ) -> int:
        value = self._decoded(decode, index, sub, kind)
        if not isinstance(value, int):
            raise DriveError(f"node {self.node_id}, {name_of(index, sub)} is no number")
        return value

    def _decoded(
        self, decode: Callable[[DataType], Value], index: int, sub: int, kind: DataType
    ) -> Value:
        try:
            return decode(kind)
        except CodecError as error:
            raise DriveError(f"node {self.node_id}, {name_of(index, sub)}: {error}") from None

    def _upload(self, index: int, sub: int) -> Upload:
        return self._transfer(lambda: Upload(index, sub), index, sub)

    def _transfer(self, begin: Callable[[], Carried], index: int, sub: int) -> Carried:
        for _ in range(self._retries):
            transfer = begin()
            try:
                if self._run(transfer):
                    return transfer
            except SdoAbortError as error:
                if transfer.request:
                    self._port.send(SDO_REQUEST_BASE + self.node_id, transfer.request)
                text = f"node {self.node_id}, {name_of(index, sub)}: {error}"
                error.args = (text,)
                raise
            self._port.send(
                SDO_REQUEST_BASE + self.node_id, abort_data(Abort.TIMED_OUT, index, sub)
            )
        raise NoAnswerError(
            f"node {self.node_id} on {self._port.bus.channel_info} does not answer for "
            f"{name_of(index, sub)} within {self._timeout_ms} ms, {self._retries} times; look at "
            "its power, its node id, the wiring and the bitrate"
        )

    def _run(self, transfer: Upload | Download) -> bool:
        """Run a transfer; returns whether it was completed in time."""
        port, timebase = self._port, self._port.timebase
        reply_id = SDO_REPLY_BASE + self.node_id
        if isinstance(transfer, Download):
            self._before_write()
        port.send(SDO_REQUEST_BASE + self.node_id, transfer.request)
        until_ns = timebase.now_ns() + self._timeout_ns
        while timebase.now_ns() < until_ns:
            message = port.receive(until_ns)
            if message is None:
                return False
            if message.arbitration_id != reply_id or message.is_error_frame:
                self._on_other(message)
                continue
            progress = transfer.feed(bytes(message.data))
            if progress is Progress.DONE:
                return True
            if progress is Progress.NEXT:
                port.send(SDO_REQUEST_BASE + self.node_id, transfer.request)
                until_ns = timebase.now_ns() + self._timeout_ns
        return False
