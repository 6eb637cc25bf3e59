"""What is drawn into: pictures with smooth edges, and depth in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from cellwright.rendering.gl.program import Program
from cellwright.rendering.gl.shaders import BEHIND_CORNER, SMOOTHING

_OWN_UNIT = 3  # of textures; see `light` for the others
BETWEEN_TEXELS = (
    (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
    (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
    (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
    (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
)


class ColourTarget:
    """A picture of several samples a pixel, and the one that comes of them.

    Args:
        width: in pixels.
        height: in pixels.
        samples: of each pixel, along what edges are smooth; 1 for jagged ones.
    """

    def __init__(self, width: int, height: int, samples: int) -> None:
        self._size = width, height
        self._drawn, self._whole = (int(each) for each in GL.glGenFramebuffers(2))
        self._stores = [int(each) for each in GL.glGenRenderbuffers(3)]
        colour, depth, whole = self._stores
        _store(colour, GL.GL_RGBA8, width, height, samples)
        _store(depth, GL.GL_DEPTH_COMPONENT32F, width, height, samples)
        _store(whole, GL.GL_RGBA8, width, height, 0)
        _join(self._drawn, colour=colour, depth=depth)
        _join(self._whole, colour=whole)

    def begin(self) -> None:
        """Draw into it from now on; nothing is there yet."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._drawn)
        GL.glViewport(0, 0, *self._size)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def read(self) -> NDArray[np.uint8]:
        """The picture (height, width, 3)."""
        width, height = self._size
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._drawn)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._whole)
        GL.glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL.GL_COLOR_BUFFER_BIT, GL.GL_NEAREST)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._whole)
        return _read(width, height)

    def free(self) -> None:
        """Give back its memory."""
        GL.glDeleteFramebuffers(2, [self._drawn, self._whole])
        GL.glDeleteRenderbuffers(3, self._stores)


class SmoothedTarget:
    """A picture of one sample a pixel whose edges are smoothed afterwards: at a fraction of what more samples cost.

    Args:
        width: in pixels.
        height: in pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = width, height
        self._smoothing = Program(BEHIND_CORNER, SMOOTHING)
        self._drawn, self._whole = (int(each) for each in GL.glGenFramebuffers(2))
        self._stores = [int(each) for each in GL.glGenRenderbuffers(2)]
        self._texture = int(GL.glGenTextures(1))
        GL.glActiveTexture(GL.GL_TEXTURE0 + _OWN_UNIT)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._texture)
        GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, GL.GL_RGBA8, width, height, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, None)
        for name, value in BETWEEN_TEXELS:
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
        depth, whole = self._stores
        _store(depth, GL.GL_DEPTH_COMPONENT32F, width, height, 0)
        _store(whole, GL.GL_RGBA8, width, height, 0)
        _join(self._drawn, depth=depth)
        GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D, self._texture, 0)
        _join(self._whole, colour=whole)

    def begin(self) -> None:
        """Draw into it from now on; nothing is there yet."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._drawn)
        GL.glViewport(0, 0, *self._size)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def read(self) -> NDArray[np.uint8]:
        """The picture (height, width, 3)."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._whole)
        GL.glDisable(GL.GL_DEPTH_TEST)
        GL.glActiveTexture(GL.GL_TEXTURE0 + _OWN_UNIT)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._texture)
        self._smoothing.use(drawn=_OWN_UNIT)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        return _read(*self._size)

    def free(self) -> None:
        """Give back its memory."""
        GL.glDeleteFramebuffers(2, [self._drawn, self._whole])
        GL.glDeleteRenderbuffers(2, self._stores)
        GL.glDeleteTextures(1, [self._texture])


class DepthTarget:
    """How far away what is seen at each pixel is.

    Args:
        width: in pixels.
        height: in pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = width, height
        self._drawn = int(GL.glGenFramebuffers(1))
        self._stores = [int(each) for each in GL.glGenRenderbuffers(2)]
        _store(self._stores[0], GL.GL_R32F, width, height, 0)
        _store(self._stores[1], GL.GL_DEPTH_COMPONENT32F, width, height, 0)
        _join(self._drawn, colour=self._stores[0], depth=self._stores[1])

    def begin(self) -> None:
        """Draw into it from now on; where nothing is drawn it is infinitely far."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._drawn)
        GL.glViewport(0, 0, *self._size)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
        GL.glClearBufferfv(GL.GL_COLOR, 0, np.full(4, np.inf, np.float32))

    def read(self) -> NDArray[np.float32]:
        """The depths (height, width) [m]."""
        width, height = self._size
        depths = np.empty((height, width), np.float32)
        GL.glReadPixels(0, 0, width, height, GL.GL_RED, GL.GL_FLOAT, depths)
        return depths

    def free(self) -> None:
        """Give back its memory."""
        GL.glDeleteFramebuffers(1, [self._drawn])
        GL.glDeleteRenderbuffers(2, self._stores)


def _read(width: int, height: int) -> NDArray[np.uint8]:
    picture = np.empty((height, width, 3), np.uint8)
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    GL.glReadPixels(0, 0, width, height, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, picture)
    return picture


def _store(store: int, form: int, width: int, height: int, samples: int) -> None:
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, store)
    GL.glRenderbufferStorageMultisample(GL.GL_RENDERBUFFER, samples if samples > 1 else 0, form, width, height)


def _join(framebuffer: int, *, colour: int | None = None, depth: int | None = None) -> None:
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    if colour is not None:
        GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_RENDERBUFFER, colour)
    if depth is not None:
        GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_RENDERBUFFER, depth)
