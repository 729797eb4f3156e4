"""Provenance of results that must be equal to the last bit: versions, processor, mathematics."""

import hashlib
import math
import platform
import struct
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import pyarrow as pa
import scipy

from legbench import __version__

CPU_INFO: Final = Path("/proc/cpuinfo")
SAMPLES: Final = 2048
"""Number of arguments that the fingerprint of the mathematics library is taken over."""


@lru_cache(maxsize=1)
def provenance() -> Mapping[str, Any]:
    """Versions of what computes, model of the processor, and the mathematics library.

    Results are equal to the bit where all of this is equal; elsewhere they are compared with a
    tolerance. The fingerprint tells apart libraries of one version that take another way on
    another processor.
    """
    return {
        "versions": versions(),
        "cpu": _cpu(),
        "libm": {"version": " ".join(platform.libc_ver()).strip(), "fingerprint": _fingerprint()},
    }


@lru_cache(maxsize=1)
def versions() -> Mapping[str, str]:
    """Versions of the packages that results depend on; shards of other ones are not mixed."""
    return {
        "legbench": __version__,
        "python": platform.python_version(),
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "pyarrow": str(pa.__version__),
        "scipy": str(scipy.__version__),
    }


def _cpu() -> str:
    """Model of the processor, as its system names it."""
    try:
        lines = CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            return value.strip()
    return platform.processor() or platform.machine()


def _fingerprint() -> str:
    """Hash of sines, cosines, exponentials and powers: 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for index in range(SAMPLES):
        x = 1e-3 + 0.0137 * index
        values = (math.sin(x), math.cos(x), math.exp(-x), math.atan2(x, 1.7), math.pow(x, 0.37))
        digest.update(struct.pack("<5d", *values))
    grid = 1e-3 + 0.0137 * np.arange(SAMPLES)
    digest.update(np.sin(grid).tobytes() + np.exp(-grid).tobytes())
    return digest.hexdigest()[:16]
