"""Frames of classic CAN <-> messages of python-can, which may be more than that."""

import can

from legbench.drives.protocol.frame import Frame

LONGEST = 8
"""Largest amount of data in a frame of classic CAN [bytes]."""
NO_FD = "these buses are classic CAN; open them without fd=True"


def frame_of(message: can.Message) -> Frame:
    """The frame that a controller sends for a message.

    Raises:
        can.CanOperationError: an error frame, an FD frame, an identifier or a length that no frame
            of classic CAN has; on the wire it would become another frame, such as an order of NMT.
    """
    data, dlc = bytes(message.data), message.dlc
    remote, extended = message.is_remote_frame, message.is_extended_id
    if (
        message.is_error_frame
        or message.is_fd
        or message.arbitration_id >> (29 if extended else 11)
        or dlc > LONGEST
        or len(data) != (0 if remote else dlc)
    ):
        raise can.CanOperationError(_objection(message))
    return Frame(message.arbitration_id, data, remote, extended, False, dlc if remote else 0)


def _objection(message: can.Message) -> str:
    """What makes a message none of classic CAN."""
    if message.is_error_frame:
        return "an error frame is not sent: controllers flag errors by themselves"
    if message.is_fd:
        return f"an FD frame is not sent: {NO_FD}"
    bits = 29 if message.is_extended_id else 11
    if message.arbitration_id >> bits:
        return f"identifier {message.arbitration_id:X}h does not fit into {bits} bits"
    if message.is_remote_frame:
        return f"a remote frame asks for {message.dlc} bytes; at most {LONGEST} can be"
    count = len(message.data)
    if count > LONGEST:
        return f"{count} bytes of data; a frame has at most {LONGEST}"
    return f"{count} bytes of data, but a DLC of {message.dlc}; make them one"


def message_of(frame: Frame, timestamp: float, channel: str, *, own: bool = False) -> can.Message:
    """The message of a frame that came at a time [s]; `own` is one that was sent here."""
    return can.Message(
        timestamp=timestamp,
        arbitration_id=frame.cob_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_error_frame=frame.error,
        dlc=frame.length,
        data=frame.data,
        channel=channel,
        is_rx=not own,
    )


def refuse_fd(fd: bool) -> None:
    """Refuse a bus with flexible data rate.

    Raises:
        can.CanInitializationError: it is asked for.
    """
    if fd:
        raise can.CanInitializationError(NO_FD)
