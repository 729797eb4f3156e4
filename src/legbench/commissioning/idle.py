"""Whether drives are as a run may find them, read by SDO; nothing is written."""

from legbench.drives.master.preparation import is_homed
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED, DriveState, decode_state, describe_statusword
from legbench.drives.protocol.datatypes import DataType


def drive_troubles(session: Session) -> list[str]:
    """Sentences on drives that no run should begin with: in fault, with power, or not homed.

    Raises:
        BusError: nobody can be asked, such as at a wrong bitrate.
        DriveError: a drive does not answer.
    """
    up = session.bring_up()
    found = []
    with up.contact():
        for node in session.config.nodes:
            statusword = up.sdo(node).get_int(0x6041, 0, DataType.UNSIGNED16)
            state, words = decode_state(statusword), describe_statusword(statusword)
            if state is DriveState.FAULT:
                found.append(f"{node.name} is in fault, {up.error_text(node)} ({words})")
            elif state in POWERED:
                found.append(f"{node.name} has power ({words})")
            elif is_homed(up, node) is False:
                found.append(f"{node.name} is not homed")
    return found
