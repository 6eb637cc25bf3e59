"""Rendering backend: choice by environment and system, and an OpenGL context without a display."""

import importlib
import os
import sys
from typing import Any

from cellwright.util.errors import CellwrightError, UsageError, did_you_mean, showable

BACKEND = "CELLWRIGHT_RENDERING"
"""Environment variable that settles how is drawn; unset or empty: by what works first."""

RAYS = "rays"
"""With no graphics library."""

BACKENDS = ("egl", "osmesa", "cgl", "glfw", RAYS)
"""What it may be; `cgl` is for macOS, `glfw` for Windows. A way that the system has not comes down to what it has."""

_MAX_SHOWN = 40  # characters of what is told again


def requested_backend() -> str:
    """The way that is settled; empty where none is. UsageError for one that does not exist."""
    way = os.environ.get(BACKEND, "")
    if way and way not in BACKENDS:
        said = showable(way, _MAX_SHOWN).replace("\n", " ")
        meant = did_you_mean(way.lower(), BACKENDS)
        raise UsageError(f"{BACKEND}={said}: give one of {', '.join(BACKENDS)}, or leave it unset{meant}")
    return way


if sys.platform == "linux":
    OPENGL_BACKENDS: tuple[str, ...] = ("egl", "osmesa")
elif sys.platform == "darwin":
    OPENGL_BACKENDS = ("cgl",)
else:
    OPENGL_BACKENDS = ("glfw",)
"""The ways that there are on this system, best first."""

_CONTEXT_SIZE = 64  # [pixels] of what the context itself would show, which nobody sees


class NoOpenGL(CellwrightError):  # noqa: N818 (it says what there is not)
    """OpenGL cannot be used this way; the text says why."""


def open_context(way: str) -> tuple[Any, str]:
    """A context of OpenGL without a display, made current in this thread, and its renderer and version in words.

    To be called before anything of OpenGL is loaded, for `way` decides what that is. The context lives as long as
    the object.

    Raises:
        NoOpenGL: there is none to be had this way.
    """
    if way in ("egl", "osmesa"):
        os.environ["PYOPENGL_PLATFORM"] = way
    else:
        os.environ.pop("PYOPENGL_PLATFORM", None)
    try:
        context = importlib.import_module(f"mujoco.{way}").GLContext(_CONTEXT_SIZE, _CONTEXT_SIZE)
        context.make_current()
        import mujoco
        from OpenGL import GL

        renderer, version = (GL.glGetString(name).decode(errors="replace") for name in (GL.GL_RENDERER, GL.GL_VERSION))
        nothing = mujoco.MjSpec().compile()
        mujoco.MjrContext(nothing, mujoco.mjtFontScale.mjFONTSCALE_50).free()  # which says what this OpenGL lacks
    except Exception as fault:  # drivers, their loaders and PyOpenGL fail in many ways, of types of their own
        raise NoOpenGL(f"{way}: {type(fault).__name__}: {' '.join(str(fault).split())[:200]}") from None
    return context, f"{renderer}, OpenGL {version}"
