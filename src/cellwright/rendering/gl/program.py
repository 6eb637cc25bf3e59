"""A program of OpenGL: compiled, and given its figures by name."""

from __future__ import annotations

from typing import Any

import numpy as np
from OpenGL import GL

from cellwright.rendering.gl.context import NoOpenGL


class Program:
    """Two shaders that work together.

    Args:
        corner: the source of the one for corners.
        pixel: that of the one for pixels.

    Raises:
        NoOpenGL: this OpenGL does not take them.
    """

    def __init__(self, corner: str, pixel: str) -> None:
        self._number = GL.glCreateProgram()
        for kind, source in ((GL.GL_VERTEX_SHADER, corner), (GL.GL_FRAGMENT_SHADER, pixel)):
            shader = GL.glCreateShader(kind)
            GL.glShaderSource(shader, source)
            GL.glCompileShader(shader)
            if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                raise NoOpenGL(f"a shader does not compile: {_text(GL.glGetShaderInfoLog(shader))}")
            GL.glAttachShader(self._number, shader)
        GL.glLinkProgram(self._number)
        if not GL.glGetProgramiv(self._number, GL.GL_LINK_STATUS):
            raise NoOpenGL(f"shaders do not fit together: {_text(GL.glGetProgramInfoLog(self._number))}")
        self._places: dict[str, int] = {}

    def use(self, **figures: Any) -> None:
        """Draw with it from now on, with these figures: whole numbers, floats, vectors, and matrices."""
        GL.glUseProgram(self._number)
        for name, value in figures.items():
            place = self._places.get(name)
            if place is None:
                place = self._places[name] = int(GL.glGetUniformLocation(self._number, name))
            if place >= 0:
                _set(place, value)


def _set(place: int, value: Any) -> None:
    if isinstance(value, int):
        GL.glUniform1i(place, value)
    elif isinstance(value, float):
        GL.glUniform1f(place, value)
    else:
        array = np.ascontiguousarray(value, np.float32)
        if array.shape[-2:] == (4, 4):
            GL.glUniformMatrix4fv(place, array.size // 16, True, array)
        else:
            GL.glUniform3fv(place, array.size // 3, array)


def _text(said: Any) -> str:
    return " ".join((said.decode(errors="replace") if isinstance(said, bytes) else str(said)).split())[:400]
