"""Two drives with one node id, given away by two answers to one question."""

from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import SDO_REPLY_BASE, SDO_REQUEST_BASE
from legbench.drives.protocol.sdo import FRAME, MUX
from legbench.drives.protocol.sdo_client import Upload

ANSWER_NS = 100_000_000
"""Longest wait for the first answer [ns]."""
ECHO_NS = 15_000_000
"""Time after an answer in which the second drive answers, too [ns]."""
QUESTIONS = 3
"""Number of questions: two drives that answer in the same bit time look like one."""


def count_answers(port: Port, node_id: int, index: int, sub: int) -> int:
    """Largest number of answers that one read of an object gets, 0 where none comes.

    Drives that send at the same instant collide where their answers differ, which destroys frames
    and shows as errors of the bus: these count as a second answer, too. So the object should be one
    in which drives differ, such as the serial number (1018h:04).

    Raises:
        BusError: the bus has failed.
    """
    most = 0
    for _ in range(QUESTIONS):
        _quiet(port)
        errors = port.error_frames
        port.send(SDO_REQUEST_BASE + node_id, Upload(index, sub).request)
        answers, until_ns = 0, port.timebase.now_ns() + ANSWER_NS
        while (message := port.receive(until_ns)) is not None:
            data = bytes(message.data)
            mine = message.arbitration_id == SDO_REPLY_BASE + node_id and len(data) == FRAME
            if not message.is_error_frame and mine and MUX.unpack_from(data)[1:] == (index, sub):
                answers += 1
                until_ns = min(until_ns, port.timebase.now_ns() + ECHO_NS)
        if answers and port.error_frames > errors:
            answers += 1
        most = max(most, answers)
    return most


def _quiet(port: Port) -> None:
    """Discard late answers to earlier questions."""
    until_ns = port.timebase.now_ns() + ECHO_NS
    while port.timebase.now_ns() < until_ns:
        port.receive(until_ns)
