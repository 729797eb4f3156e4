"""The program that records for a control loop in real time: `python -m legbench.recording.process`.

`process_disk.ProcessDisk` starts it with three descriptors: samples, events, and a socket on which
packets come. It is in no hurry: a second of rows waits in the kernel. When its master has gone it
writes what is still in the queue, without an end mark, and ends.
"""

import os
import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Final

import numpy as np
import pyarrow as pa

from legbench.recording.files import Appender
from legbench.recording.log_file import RingDrain
from legbench.recording.process_disk import (
    END,
    EVENT,
    LOG,
    LOG_END,
    REPORT,
    ROWS,
    UNKNOWN,
    longest_packet,
)
from legbench.recording.ring import Ring
from legbench.recording.store import RunStore

NOTHING: Final = b""
"""A packet that has not come, within `LOOK_EVERY`."""
LOOK_EVERY: Final = struct.pack("ll", 0, 100_000)
"""Time after which logs are looked at though no packet has come, as before the first row: 0.1 s
as a `timeval` of the system's."""


def main(arguments: list[str]) -> int:
    """Write until the end of the run, or of the process that records it."""
    samples, events, number = (int(argument) for argument in arguments)
    with open(f"/proc/self/fd/{samples}", "rb") as opening:
        schema = pa.ipc.open_stream(opening).schema
    store = RunStore(_grown(samples), _grown(events), schema)
    with socket.socket(fileno=number) as master:
        if not _serve(master, store, len(schema), longest_packet(schema)):
            store.finish(end=False)
            return 1
        store.finish()
        # What was dropped before is in this one, and somebody waits for it.
        master.send(_report(store, ended=True))
    return 0


def _serve(master: socket.socket, store: RunStore, columns: int, longest: int) -> bool:
    """Write packet by packet; whether the run has ended, rather than its process."""
    line, logs = b"", list[RingDrain]()
    with ExitStack() as closing:
        for packet, descriptors in _packets(master, longest):
            kind, content = packet[:1], packet[1:]
            for log in logs:
                log.drain(everything=kind != NOTHING)
            if kind == END:
                return True
            if kind == ROWS:
                store.write(np.frombuffer(content).reshape(columns, -1))
            elif kind == EVENT:
                line += content
                if line.endswith(b"\n"):
                    store.event(line)
                    line = b""
            elif kind == LOG:
                ring, file = descriptors
                logs.append(RingDrain(Ring(ring), store.log(_grown(file))))
                closing.callback(logs[-1].close)
                master.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, LOOK_EVERY)
            elif kind == LOG_END:
                logs[content[0]].close()
            if kind == NOTHING:
                continue
            try:
                # Whoever ends a log waits for the report that it is closed.
                master.send(
                    _report(store, ended=False), 0 if kind == LOG_END else socket.MSG_DONTWAIT
                )
            except OSError:
                # Nobody reads reports now, or ever again; packets may still be there.
                continue
    return False


def _packets(master: socket.socket, longest: int) -> Iterator[tuple[bytes, list[int]]]:
    """Packets with the descriptors that came with them; an empty one when none came for a while."""
    while True:
        try:
            packet, descriptors, _, _ = socket.recv_fds(master, longest, 2)
        except BlockingIOError:
            yield NOTHING, []
            continue
        except ConnectionResetError:
            # Told once, when the other end has gone with unread reports; the queue comes after it.
            continue
        if not packet:
            return
        yield packet, list(descriptors)


def _grown(descriptor: int) -> Appender:
    file = Appender(descriptor)
    file.size = os.fstat(descriptor).st_size
    return file


def _report(store: RunStore, *, ended: bool) -> bytes:
    kept = store.kept
    errors = (_number(kept.error), _number(kept.events_error))
    return REPORT.pack(kept.rows, kept.first, kept.last, *errors, ended)


def _number(error: Exception | None) -> int:
    if error is None:
        return 0
    return (error.errno or UNKNOWN) if isinstance(error, OSError) else UNKNOWN


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
