"""Storing of what drives hold in their memory (CiA 301, object 1010h); no drive is enabled."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.drives.errors import DriveError, NoAnswerError, SdoAbortError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.parking import park
from legbench.drives.master.preparation import refuse_powered
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.session import Session
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.memory import BY_ITSELF, ON_COMMAND, SAVE_SIGNATURE, STORE
from legbench.drives.setup.config import NodeConfig
from legbench.errors import ConfigError

LONGEST = 60.0
"""Longest time that a drive may take to write its memory [s]."""
LAST_PART = 127
"""Highest sub-index of 1010h; parts from 4 on are the maker's own."""
COMMUNICATION = (1, 2)
"""Parts of 1010h that hold the COB-IDs of command frames."""
U32 = DataType.UNSIGNED32


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """Drive whose parameters have been stored."""

    node: str
    part: int
    """Sub-index of 1010h that was written."""
    by_itself: bool
    """Whether the drive says that it stores by itself, too."""


def store(
    session: Session, nodes: Sequence[NodeConfig], *, part: int = 1, timeout: float = 10.0
) -> list[Stored]:
    """Make drives store their parameters: write the signature "save", check every answer.

    Command frames are switched off first, as at the end of every run: drives that wake up with them
    would obey a log that is played back. The signature is written once: a memory of this kind bears
    some 10 000 writes.

    Args:
        session: the channel is taken.
        nodes: drives of the bus file.
        part: sub-index of 1010h: 1 all, 2 communication, 3 application, from 4 on the maker's.
        timeout: longest wait for a drive's answer [s].

    Raises:
        ConfigError: a part or a time that does not exist.
        BusError: the channel has a master.
        PlantFault: somebody else leads these drives.
        DriveError: a drive has power, is another one, or does not store; those before it have.
    """
    if not 1 <= part <= LAST_PART:
        raise ConfigError(f"part is {part}; it must be 1 to {LAST_PART}, 1 stores all")
    if not 0.0 < timeout <= LONGEST:
        raise ConfigError(f"timeout is {timeout:g} s; it must be positive, {LONGEST:g} s at most")
    session.hold()
    up = session.bring_up()
    up.listen()
    up.identify()
    refuse_powered(up, session.config.nodes)
    if part in COMMUNICATION:
        failed = park(session.port(), session.config, up.detector.check_frame)
        if failed:
            raise DriveError(f"{failed[0]}; nothing has been stored")
    done: list[Stored] = []
    for node in nodes:
        try:
            done.append(_store(session, up, node, part, timeout))
        except DriveError as error:
            if done:
                error.add_note(f"stored before that: {', '.join(one.node for one in done)}")
            raise
    return done


def _store(session: Session, up: BringUp, node: NodeConfig, part: int, timeout: float) -> Stored:
    what = f"drive '{node.name}' (node {node.node_id})"
    can_do = _ability(up, node, part)
    if not can_do & ON_COMMAND:
        raise DriveError(
            f"{what} stores nothing on command: 1010h:{part:02X} reads {can_do:08X}h, bit 0 is "
            "not set; use its maker's tool, every run writes the bus file anew"
        )
    patient = SdoPort(
        session.port(),
        node.node_id,
        timeout_ms=round(1e3 * timeout),
        retries=1,
        on_other=up.detector.check_frame,
        before_write=up.poll_frames,
    )
    try:
        patient.put(STORE, part, U32, SAVE_SIGNATURE)
    except NoAnswerError as error:
        raise NoAnswerError(
            f"{what} has not answered to 1010h:{part:02X} within {timeout:g} s, so whether it has "
            "stored is not known; switch it off and on, compare with `legbench drives configure`"
        ) from error
    _ability(up, node, part)
    return Stored(node=node.name, part=part, by_itself=bool(can_do & BY_ITSELF))


def _ability(up: BringUp, node: NodeConfig, part: int) -> int:
    """Read what a drive can store (1010h); raises DriveError where it has no such part."""
    try:
        return up.sdo(node).get_int(STORE, part, U32)
    except SdoAbortError as error:
        raise DriveError(
            f"drive '{node.name}' (node {node.node_id}) cannot store part {part}: {error}; part 1 "
            "is all, and every run writes the bus file anew"
        ) from error
