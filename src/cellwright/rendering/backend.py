"""Rendering backend: choice by environment and system, and an OpenGL context without a display."""

import importlib
import os
import sys
from typing import Any

from cellwright.util.errors import CellwrightError, UsageError, did_you_mean, printable

BACKEND = "CELLWRIGHT_RENDERING"
"""Environment variable that sets the backend; unset or empty: the first one that works."""

RAYS = "rays"
"""Backend without a graphics library."""

BACKENDS = ("egl", "osmesa", "cgl", "glfw", RAYS)
"""Its values; `cgl` is for macOS, `glfw` for Windows. An unavailable one falls back to those of the system."""

_MAX_SHOWN = 40  # characters of a value in an error
_CONTEXT_SIZE = 64  # [pixels] of the context's own picture, which is never shown


def requested_backend() -> str:
    """Return the backend that the environment sets; empty if it sets none.

    Raises:
        UsageError: there is no such backend.
    """
    backend = os.environ.get(BACKEND, "")
    if backend and backend not in BACKENDS:
        value = printable(backend, _MAX_SHOWN).replace("\n", " ")
        suggestion = did_you_mean(backend.lower(), BACKENDS)
        raise UsageError(
            f"{BACKEND}={value}: unknown backend; set one of {', '.join(BACKENDS)}, or unset it{suggestion}"
        )
    return backend


if sys.platform == "linux":
    OPENGL_BACKENDS: tuple[str, ...] = ("egl", "osmesa")
elif sys.platform == "darwin":
    OPENGL_BACKENDS = ("cgl",)
else:
    OPENGL_BACKENDS = ("glfw",)
"""OpenGL backends of this system, best first."""


class NoOpenGL(CellwrightError):  # noqa: N818 (it says what there is not)
    """Error of an OpenGL backend that does not work; the text says why."""


def open_context(backend: str) -> tuple[Any, str]:
    """Return an OpenGL context without a display, current in this thread, and its renderer and version as text.

    Call it before anything loads OpenGL, since `backend` decides what is loaded. The object keeps the context alive.

    Raises:
        NoOpenGL: this backend does not work.
    """
    if backend in ("egl", "osmesa"):
        os.environ["PYOPENGL_PLATFORM"] = backend
    else:
        os.environ.pop("PYOPENGL_PLATFORM", None)
    try:
        context = importlib.import_module(f"mujoco.{backend}").GLContext(_CONTEXT_SIZE, _CONTEXT_SIZE)
        context.make_current()
        import mujoco
        from OpenGL import GL

        renderer, version = (GL.glGetString(name).decode(errors="replace") for name in (GL.GL_RENDERER, GL.GL_VERSION))
        nothing = mujoco.MjSpec().compile()
        mujoco.MjrContext(nothing, mujoco.mjtFontScale.mjFONTSCALE_50).free()  # raises what this OpenGL lacks
    except Exception as fault:  # drivers, their loaders and PyOpenGL fail in many ways, with types of their own
        raise NoOpenGL(f"{backend}: {type(fault).__name__}: {' '.join(str(fault).split())[:200]}") from None
    return context, f"{renderer}, OpenGL {version}"
