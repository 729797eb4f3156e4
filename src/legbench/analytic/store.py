"""Compiled integrators kept on disk between processes.

A file holds one pickled integrator under a name made of everything that decides it: the formulas,
the versions of heyoka and Python, and the processor it was compiled for. Files are whole or not
there, begin with the digest of their content, and are rebuilt when it does not fit. A folder
that cannot be written is no obstacle: the integrator is then compiled anew in each process.
"""

import hashlib
import os
import pickle
import platform
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from legbench.analytic._heyoka import heyoka as hy
from legbench.writing import write_whole

DIGEST = hashlib.sha256().digest_size
ENVIRONMENT = "LEGBENCH_CACHE"
"""Environment variable that names the folder; empty: nothing is kept."""

PROCESSOR = ("model name", "flags", "Features", "CPU implementer", "CPU part")
"""Lines of Linux's `/proc/cpuinfo` that say what code a processor runs."""
UNREADABLE = (
    *(pickle.UnpicklingError, EOFError, ImportError, AttributeError),
    *(ValueError, TypeError, RuntimeError),
)
"""What unpickling raises of a file that another build has written."""
OTHERS_WRITE = 0o022
"""Permission of group or others to write."""


def cache_folder() -> Path | None:
    """Folder of the compiled integrators, after `LEGBENCH_CACHE` or the platform's custom."""
    named = os.environ.get(ENVIRONMENT)
    if named is not None:
        return Path(named) if named else None
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(base) / "legbench" if os.path.isabs(base) else None


def kept(recipe: str, build: Callable[[], Any]) -> Any:
    """What `build` makes, from disk if this machine has built it before.

    Args:
        recipe: text that is different for every different result of `build`.
        build: makes the object, which must survive pickling.
    """
    folder = cache_folder()
    name = hashlib.sha256(f"{recipe}\n{machine()}".encode()).hexdigest()
    path = None if folder is None else folder / f"{name[:32]}.integrator"
    found = None if path is None else _read(path)
    if found is None:
        with _own_store_only():
            found = build()
        if path is not None:
            _write(path, found)
    return found


@cache
def machine() -> str:
    """Versions and processor for which code is compiled."""
    try:
        first = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("\n\n")[0]
        told = [line for line in first.splitlines() if line.startswith(PROCESSOR)]
    except OSError:
        told = [platform.processor(), platform.node()]
    return "\n".join([hy.__version__, sys.version, platform.machine(), *told])


def _read(path: Path) -> Any:
    """The object of an intact file that nobody else can have written, else None."""
    try:
        if path.parent.stat().st_mode & OTHERS_WRITE:  # unpickling runs what the file says
            return None
        content = path.read_bytes()
    except OSError:
        return None
    digest, body = content[:DIGEST], content[DIGEST:]
    if hashlib.sha256(body).digest() != digest:
        return None
    try:
        return pickle.loads(body)
    except UNREADABLE:
        return None


def _write(path: Path, content: Any) -> None:
    """Keep an object, whole or not at all."""
    body = pickle.dumps(content)
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(path, hashlib.sha256(body).digest() + body)


@contextmanager
def _own_store_only() -> Iterator[None]:
    """Compile past heyoka's own store, which does not know processors apart."""
    state = hy.llvm_state
    was = state.get_diskcache_enabled()
    state.set_diskcache_enabled(False)
    try:
        yield
    finally:
        state.set_diskcache_enabled(was)
