"""Files of rerun that say when they cannot be written.

rerun's own file sink swallows the errors of its disk, and waits for ever once a write has failed.
It writes into a pipe here, whose other end never fails, and what comes out is written by Python.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from legbench.viz.live._rerun import rr

PIECE = 1 << 16
"""Bytes that are written at once: what a pipe holds."""


@contextmanager
def saved(stream: rr.RecordingStream, path: Path) -> Iterator[None]:
    """Write what is logged to a stream into a file; the stream is disconnected at the end.

    Args:
        stream: stream without another sink.
        path: file to write.

    Raises:
        OSError: the file cannot be written, to its last byte.
    """
    if (
        sys.platform == "win32"
    ):  # No pipe can be opened there by a name: the file passes through memory.
        whole = stream.binary_stream()
        yield
        path.write_bytes(whole.read() or b"")
        stream.disconnect()
        return
    source, sink = os.pipe()
    failed: list[OSError] = []
    writer = threading.Thread(target=_copy, args=(source, path, failed), daemon=True)
    writer.start()
    try:
        try:
            stream.save(f"/dev/fd/{sink}")
        finally:
            os.close(sink)  # rerun has opened its own end; the last one that closes ends the file.
        yield
    finally:
        stream.disconnect()
        writer.join()
    if failed:
        raise failed[0]


def _copy(source: int, path: Path, failed: list[OSError]) -> None:
    """Write all that comes out of a pipe into a file; after an error, take the rest and drop it."""
    with os.fdopen(source, "rb", buffering=0) as pipe:
        try:
            with path.open("wb") as file:
                while piece := pipe.read(PIECE):
                    file.write(piece)
        except OSError as error:
            failed.append(error)
            while pipe.read(PIECE):
                pass
