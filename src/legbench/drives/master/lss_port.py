"""LSS master (CiA 305) over a port: blocking, with time-outs; for one drive at a time."""

from typing import final

from legbench.drives.errors import DriveError, NoAnswerError
from legbench.drives.master.port import Port
from legbench.drives.protocol.lss import (
    ADDRESS,
    ANSWER_ID,
    FRAME,
    REQUEST_ID,
    RESET_SCAN,
    WORDS,
    Lss,
    LssAddress,
    LssError,
    LssMode,
    lss_frame,
    scan_frame,
    select_frames,
)

ANSWER_NS = 500_000_000
"""Longest wait for an answer that has to come [ns]."""
SCAN_NS = 25_000_000
"""Longest wait for an answer that may not come, of which a scan has about 250 [ns]."""
STORE_NS = 5_000_000_000
"""Longest wait for a drive that writes its memory [ns]."""
SEND_NS = 2_000_000
"""Time in which a frame is on the wire [ns]."""
ECHO_NS = 15_000_000
"""Time after an answer in which a second drive would answer, too [ns]."""


@final
class LssPort:
    """Asks drives by layer setting services.

    Drives that answer at the same time with the same bytes look like one, so that only questions
    whose answers differ, or that one drive alone may answer, tell how many there are.
    """

    def __init__(self, port: Port) -> None:
        self._port = port

    def ask(self, data: bytes, wait_ns: int = ANSWER_NS) -> list[bytes]:
        """Send a request and return all answers: the first in time, others right after it.

        Raises:
            BusError: the bus has failed.
        """
        port = self._port
        while port.take() is not None:
            pass
        port.send(REQUEST_ID, data)
        answers: list[bytes] = []
        until_ns = port.timebase.now_ns() + wait_ns
        while (message := port.receive(until_ns)) is not None:
            if message.is_error_frame or message.arbitration_id != ANSWER_ID:
                continue
            if len(message.data) == FRAME:
                answers.append(bytes(message.data))
                until_ns = min(until_ns, port.timebase.now_ns() + ECHO_NS)
        return answers

    def release(self) -> None:
        """Bring all drives back to waiting, where a first node id is used; raises BusError."""
        port = self._port
        port.send(REQUEST_ID, lss_frame(Lss.SWITCH_GLOBAL, bytes((LssMode.WAITING,))))
        # An interface that is closed at once may drop what it has not sent.
        port.timebase.wait_until(port.timebase.now_ns() + SEND_NS)

    def select(self, address: LssAddress) -> None:
        """Bring the one drive of an address into configuration.

        Raises:
            NoAnswerError: no drive has this address, or none knows LSS.
            DriveError: two have it.
        """
        *first, last = select_frames(address)
        for frame in first:
            self._port.send(REQUEST_ID, frame)
        self._one(last, Lss.SELECTED, "be selected by its identity")

    def node_id(self) -> int:
        """Node id of the selected drive, 255 of one without; raises as `select`."""
        return self._one(lss_frame(Lss.INQUIRE_NODE_ID), Lss.INQUIRE_NODE_ID, "tell its node id")[1]

    def address(self) -> LssAddress:
        """Address that the selected drive itself names; raises as `select`."""
        words = [
            int(ADDRESS.unpack_from(self._one(lss_frame(code), code, "tell its identity"), 1)[0])
            for code in range(Lss.INQUIRE_VENDOR, Lss.INQUIRE_VENDOR + WORDS)
        ]
        return (words[0], words[1], words[2], words[3])

    def configure(self, node_id: int) -> None:
        """Give the selected drive a node id, in use after its next reset; raises as `select`."""
        asked = lss_frame(Lss.CONFIGURE_NODE_ID, bytes((node_id,)))
        answer = self._one(asked, Lss.CONFIGURE_NODE_ID, "take a node id")
        if answer[1] != LssError.NONE:
            raise DriveError(
                f"the drive refuses node id {node_id}, LSS error {answer[1]} (maker's own "
                f"{answer[2]}); it keeps the one that it has"
            )

    def store(self) -> LssError | None:
        """Make the selected drive store its node id; none for an error of its maker."""
        answer = self._one(lss_frame(Lss.STORE), Lss.STORE, "store its node id", STORE_NS)
        return LssError(answer[1]) if answer[1] in list(LssError) else None

    def _one(self, data: bytes, wanted: int, what: str, wait_ns: int = ANSWER_NS) -> bytes:
        answers = [answer for answer in self.ask(data, wait_ns) if answer[0] == wanted]
        if not answers:
            raise NoAnswerError(
                f"no drive answers over LSS when asked to {what}; set the node id of one without "
                "LSS by its switches or its maker's tool"
            )
        if len(answers) > 1:
            raise DriveError(
                f"{len(answers)} drives answer over LSS when asked to {what}; leave one alone on "
                "the bus"
            )
        return answers[0]

    def any_unconfigured(self) -> bool:
        """Whether any drive has no node id."""
        answers = self.ask(lss_frame(Lss.IDENTIFY_UNCONFIGURED), 4 * SCAN_NS)
        return any(answer[0] == Lss.UNCONFIGURED_IDENTIFIED for answer in answers)

    def find_unconfigured(self) -> LssAddress | None:
        """Find the address of the one drive without node id by a fast scan, and select it.

        Both values of every bit are asked for: two drives differ in at least one.

        Raises:
            DriveError: two such drives answer.
        """
        if not self._hears(scan_frame(0, RESET_SCAN, 0, 0)):
            return None
        words: list[int] = []
        for sub in range(WORDS):
            word = 0
            for bit in range(31, -1, -1):
                word = self._bit(word, bit, sub)
            following = (sub + 1) % WORDS
            if not self._hears(scan_frame(word, 0, sub, following), ANSWER_NS):
                raise NoAnswerError(
                    f"a drive without node id answers no more in its fast scan, word {sub}; try "
                    "again with nothing else on the bus"
                )
            words.append(word)
        return (words[0], words[1], words[2], words[3])

    def _bit(self, word: int, bit: int, sub: int) -> int:
        """Return the word with this bit as the drive has it."""
        # Where bit 0 fits, the drive goes on to the word named as following: to the same one.
        there = [
            value
            for value in (word, word | 1 << bit)
            if self._hears(scan_frame(value, bit, sub, sub))
        ]
        if len(there) > 1:
            raise DriveError(
                "two drives without node id answer over LSS; leave one alone on the bus"
            )
        return there[0] if there else word

    def _hears(self, data: bytes, wait_ns: int = SCAN_NS) -> bool:
        return any(answer[0] == Lss.IDENTIFIED for answer in self.ask(data, wait_ns))
