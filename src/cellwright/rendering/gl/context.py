"""A place to draw without a display: EGL, or else Mesa's own, in the memory of the process."""

from __future__ import annotations

import os
import sys
from typing import Any

from cellwright.util.errors import CellwrightError

if sys.platform == "linux":
    WAYS: tuple[str, ...] = ("egl", "osmesa")
elif sys.platform == "darwin":
    WAYS = ("cgl",)
else:
    WAYS = ("glfw",)
"""The ways that there are on this system, best first."""

_LEAST = (4, 3)
_ENOUGH = 64  # [pixels] of what the context itself would show, which nobody sees


class NoOpenGL(CellwrightError):  # noqa: N818 (it says what there is not)
    """OpenGL cannot be used this way; the text says why."""


def choose(way: str) -> None:
    """Have this process use OpenGL this way; to be called before anything of it is loaded, for that decides it."""
    if way in ("egl", "osmesa"):
        os.environ["PYOPENGL_PLATFORM"] = way
    else:
        os.environ.pop("PYOPENGL_PLATFORM", None)


def open_context(way: str) -> Any:
    """A context of OpenGL, made current in this thread; it lives as long as what is returned.

    Args:
        way: the one that was chosen.

    Raises:
        NoOpenGL: there is none to be had this way.
    """
    try:
        context = _of(way)(_ENOUGH, _ENOUGH)
        context.make_current()
        from OpenGL import GL

        said = GL.glGetString(GL.GL_VERSION)
        version = (GL.glGetIntegerv(GL.GL_MAJOR_VERSION), GL.glGetIntegerv(GL.GL_MINOR_VERSION))
    except Exception as fault:  # drivers, their loaders and PyOpenGL fail in many ways, of types of their own
        raise NoOpenGL(f"{way}: {type(fault).__name__}: {' '.join(str(fault).split())[:200]}") from None
    if tuple(int(part) for part in version) < _LEAST:
        raise NoOpenGL(f"{way}: OpenGL {said!r} is too old: {_LEAST[0]}.{_LEAST[1]} at least")
    return context


def _of(way: str) -> Any:
    if way == "egl":
        from mujoco.egl import GLContext
    elif way == "osmesa":
        from mujoco.osmesa import GLContext
    elif way == "cgl":
        from mujoco.cgl import GLContext
    else:
        from mujoco.glfw import GLContext
    return GLContext
