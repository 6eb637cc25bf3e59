"""OpenGL framebuffers: colour, smoothed colour, depth, and shadow maps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from cellwright.rendering.gl.shaders import BEHIND_CORNER, SMOOTHING, Program

_OWN_UNIT = 3  # of textures; see `light` for the others
BETWEEN_TEXELS = (
    (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
    (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
    (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
    (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
)


class Target:
    """Something to draw into.

    Args:
        width: in pixels.
        height: in pixels.
        framebuffers: how many it has; the first is drawn into.
        stores: how many stores of pixels they have.
    """

    def __init__(self, width: int, height: int, *, framebuffers: int, stores: int) -> None:
        self._size = width, height
        self._framebuffers = np.atleast_1d(GL.glGenFramebuffers(framebuffers)).tolist()
        self._stores = np.atleast_1d(GL.glGenRenderbuffers(stores)).tolist()

    def begin(self) -> None:
        """Draw into it from now on; nothing is there yet."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffers[0])
        GL.glViewport(0, 0, *self._size)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def free(self) -> None:
        """Give back its memory."""
        GL.glDeleteFramebuffers(len(self._framebuffers), self._framebuffers)
        GL.glDeleteRenderbuffers(len(self._stores), self._stores)


class ColourTarget(Target):
    """A picture of several samples a pixel, and the one that comes of them.

    Args:
        width: in pixels.
        height: in pixels.
        samples: of each pixel, along what edges are smooth; 1 for jagged ones.
    """

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height, framebuffers=2, stores=3)
        self._drawn, self._whole = self._framebuffers
        colour, depth, whole = self._stores
        _store(colour, GL.GL_RGBA8, width, height, samples)
        _store(depth, GL.GL_DEPTH_COMPONENT32F, width, height, samples)
        _store(whole, GL.GL_RGBA8, width, height, 0)
        _join(self._drawn, colour=colour, depth=depth)
        _join(self._whole, colour=whole)

    def read(self) -> NDArray[np.uint8]:
        """The picture (height, width, 3)."""
        width, height = self._size
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._drawn)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._whole)
        GL.glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL.GL_COLOR_BUFFER_BIT, GL.GL_NEAREST)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._whole)
        return _read(width, height)


class SmoothedTarget(Target):
    """A picture of one sample a pixel whose edges are smoothed afterwards: at a fraction of what more samples cost.

    Args:
        width: in pixels.
        height: in pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        super().__init__(width, height, framebuffers=2, stores=2)
        drawn, self._whole = self._framebuffers
        self._smoothing = Program(BEHIND_CORNER, SMOOTHING)
        self._texture = int(GL.glGenTextures(1))
        GL.glActiveTexture(GL.GL_TEXTURE0 + _OWN_UNIT)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._texture)
        GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, GL.GL_RGBA8, width, height, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, None)
        for name, value in BETWEEN_TEXELS:
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
        depth, whole = self._stores
        _store(depth, GL.GL_DEPTH_COMPONENT32F, width, height, 0)
        _store(whole, GL.GL_RGBA8, width, height, 0)
        _join(drawn, depth=depth)
        GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D, self._texture, 0)
        _join(self._whole, colour=whole)

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
        super().free()
        GL.glDeleteTextures(1, [self._texture])


class DepthTarget(Target):
    """How far away what is seen at each pixel is.

    Args:
        width: in pixels.
        height: in pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        super().__init__(width, height, framebuffers=1, stores=2)
        distance, depth = self._stores
        _store(distance, GL.GL_R32F, width, height, 0)
        _store(depth, GL.GL_DEPTH_COMPONENT32F, width, height, 0)
        _join(self._framebuffers[0], colour=distance, depth=depth)

    def begin(self) -> None:
        """Draw into it from now on; where nothing is drawn it is infinitely far."""
        super().begin()
        GL.glClearBufferfv(GL.GL_COLOR, 0, np.full(4, np.inf, np.float32))

    def read(self) -> NDArray[np.float32]:
        """The depths (height, width) [m]."""
        width, height = self._size
        depths = np.empty((height, width), np.float32)
        GL.glReadPixels(0, 0, width, height, GL.GL_RED, GL.GL_FLOAT, depths)
        return depths


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


class ShadowMaps:
    """Maps of how far light comes from some lamps: once for what stands still, and with all that moves.

    Args:
        side: of each, in texels.
        layers: how many there are; None for one that is no array.
    """

    def __init__(self, side: int, layers: int | None) -> None:
        self._side, self._layers = side, layers
        self._kind = GL.GL_TEXTURE_2D if layers is None else GL.GL_TEXTURE_2D_ARRAY
        self._still, self._all = (int(each) for each in GL.glGenTextures(2))
        self._drawn = int(GL.glGenFramebuffers(1))
        for texture in (self._still, self._all):
            GL.glBindTexture(self._kind, texture)
            form, source = GL.GL_DEPTH_COMPONENT32F, (GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, None)
            if layers is None:
                GL.glTexImage2D(self._kind, 0, form, side, side, 0, *source)
            else:
                GL.glTexImage3D(self._kind, 0, form, side, side, layers, 0, *source)
            compare = (GL.GL_TEXTURE_COMPARE_MODE, GL.GL_COMPARE_REF_TO_TEXTURE)
            for name, value in (*BETWEEN_TEXELS, compare):
                GL.glTexParameteri(self._kind, name, value)

    def bind(self, unit: int) -> None:
        """Have shaders look them up as texture `unit`."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(self._kind, self._all)

    def draw_still(self, draw: Any) -> None:
        """Draw what stands still; `draw` is called with the number of each map."""
        for layer in range(self._layers or 1):
            self._begin(self._still, layer)
            GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
            draw(layer)

    def draw_moving(self, draw: Any) -> None:
        """Draw what moves besides."""
        side, layers = self._side, self._layers or 1
        GL.glCopyImageSubData(
            self._still, self._kind, 0, 0, 0, 0, self._all, self._kind, 0, 0, 0, 0, side, side, layers
        )
        for layer in range(layers):
            self._begin(self._all, layer)
            draw(layer)

    def _begin(self, texture: int, layer: int) -> None:
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._drawn)
        if self._layers is None:
            GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, self._kind, texture, 0)
        else:
            GL.glFramebufferTextureLayer(GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, texture, 0, layer)
        GL.glDrawBuffer(GL.GL_NONE)
        GL.glReadBuffer(GL.GL_NONE)
        GL.glViewport(0, 0, self._side, self._side)
