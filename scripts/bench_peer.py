"""A peer behind an AF_UNIX bus that answers every SYNC with a motion that was recorded.

It is a process of its own, and may be moved to another processor: drives do not compute on their
master's.
"""

import multiprocessing
import os
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can
from bench_motion import ANSWERS, SYNC, Motion

from legbench.drives.protocol.frame import Frame
from legbench.drives.transport.unix_bus import UnixBus
from legbench.drives.transport.unix_packet import PACKET, pack_frame, unpack_frame

APART, SHARED = "apart", "shared"
"""Where the peer computes: on a processor of its own, or on the one of the link."""
BEAT_EVERY = 10
PLAY = 0x7E0
"""Order to the peer, an identifier that no drive has: whether its motion goes on at each SYNC."""
SDO_REQUESTS, TEMPERATURE = (0x601, 0x602), bytes.fromhex("4B702000FA000000")
"""The only object that is asked for in the cycle: 2070h, 25.0 deg C."""
QUIET = 0.005
"""Time without a frame after which the peer has answered all that it was sent [s]."""


def peer(listener: socket.socket, motion: Motion) -> None:
    """Answer every SYNC until the other end is closed."""
    port, _ = listener.accept()
    rows = [
        [pack_frame(Frame(cob_id, data)) for cob_id, data in zip(ANSWERS, row, strict=True)]
        for row in motion.answers
    ]
    beats = [pack_frame(Frame(0x700 + node_id, b"\x05")) for node_id in (1, 2)]
    count, row, step = 0, -1, 0
    while True:
        try:
            frame = unpack_frame(port.recv(PACKET.size + 1))
        except ConnectionResetError:
            return
        if frame is None:
            return
        if frame.cob_id == SYNC:
            count, row = count + 1, row + step
            for packet in rows[max(row, 0)]:
                port.send(packet)
            if count % BEAT_EVERY == 0:
                for packet in beats:
                    port.send(packet)
        elif frame.cob_id in SDO_REQUESTS:
            port.send(pack_frame(Frame(frame.cob_id - 0x80, TEMPERATURE)))
        elif frame.cob_id == PLAY:
            step = frame.data[0]


def processors() -> dict[str, int]:
    """Processor of the peer in each place; the link has the one that both may share."""
    first, *others = sorted(os.sched_getaffinity(0))
    if not others:
        raise SystemExit("this machine lends one processor; the link and its peer need two")
    return {APART: others[-1], SHARED: first}


@contextmanager
def served(motion: Motion) -> Iterator[tuple[UnixBus, Callable[[str], None]]]:
    """A bus behind which a peer of its own process replays a motion, and what moves that peer."""
    places = processors()
    with (
        tempfile.TemporaryDirectory() as folder,
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener,
    ):
        listener.bind(f"{folder}/bus")
        listener.listen()
        process = multiprocessing.get_context("fork").Process(
            target=peer, args=(listener, motion), daemon=True
        )
        process.start()
        bus, before, pid = UnixBus(f"{folder}/bus"), os.sched_getaffinity(0), process.pid
        assert pid is not None
        os.sched_setaffinity(0, {places[SHARED]})
        try:
            yield bus, lambda place: os.sched_setaffinity(pid, {places[place]})
        finally:
            os.sched_setaffinity(0, before)
            bus.shutdown()
            process.join(2.0)


def play(bus: can.BusABC, goes_on: bool) -> None:
    """Tell the peer whether its motion goes on at each SYNC; late answers are none to the next."""
    bus.send(can.Message(arbitration_id=PLAY, data=[goes_on], is_extended_id=False))
    while bus.recv(QUIET) is not None:
        pass
