"""Rendering MuJoCo scenes without a window."""

import ctypes
import os
import sys
from collections.abc import Callable
from ctypes.util import find_library
from importlib import import_module
from types import TracebackType
from typing import Any, Self, final

import mujoco
import numpy as np
from numpy.typing import NDArray

from legbench.errors import MissingExtraError
from legbench.viz.display import has_display

try:
    from OpenGL.error import Error as OpenGLError
except ImportError as error:
    raise MissingExtraError(
        "PyOpenGL is not installed; rendering needs it: pip install 'legbench[render]'"
    ) from error

Image = NDArray[np.uint8]

LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
"""OpenGL libraries that need no display, best first: value of MUJOCO_GL -> shared library."""
WAY_OUT = "on Debian install libegl1 and libgl1-mesa-dri"
REFUSALS = (ImportError, AttributeError, OSError, RuntimeError, OpenGLError, mujoco.FatalError)
"""Exceptions that a machine without a working OpenGL driver raises."""


def backend() -> str:
    """The OpenGL that will be used: what MUJOCO_GL asks for, else what the machine has.

    The choice is made here because MuJoCo decides only once, when it is imported.

    Raises:
        MissingExtraError: there is none.
    """
    wish = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wish in LIBRARIES or (wish == "glfw" and has_display()):
        return wish
    if wish in ("", "1", "on", "true", "enable", "enabled"):
        if sys.platform != "linux":
            return "gl_context"
        found = [name for name, library in LIBRARIES.items() if find_library(library)]
        if found:
            return found[0]
    raise MissingExtraError(f"no OpenGL to render with (MUJOCO_GL={wish!r}); {WAY_OUT}")


@final
class OffScreen:
    """Draws scenes of one model into images of one size; use it in a `with`.

    Raises:
        MissingExtraError: the machine has no OpenGL that works.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        name = backend()
        try:
            make: Callable[[int, int], Any] = import_module(f"mujoco.{name}").GLContext
            self._gl = make(width, height)
            self._gl.make_current()
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except REFUSALS as error:
            raise MissingExtraError(
                f"OpenGL by {name} does not work here: {error}; {WAY_OUT}"
            ) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), dtype=np.uint8)

    def draw(self, scene: mujoco.MjvScene) -> Image:
        """The scene as an image (height, width, 3) of its own."""
        self._gl.make_current()
        mujoco.mjr_render(self._rect, scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._rect, self._context)
        return self._pixels[::-1].copy()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._context.free()
        try:
            self._gl.free()
        except ctypes.ArgumentError:
            # PyOpenGL refuses MuJoCo's way of letting an OSMesa context go; the process keeps it.
            self._gl._context = None
