"""What is drawn into: pictures with smooth edges, depth in metres, and maps of what light reaches."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL


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
        picture = np.empty((height, width, 3), np.uint8)
        GL.glReadPixels(0, 0, width, height, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, picture)
        return picture

    def free(self) -> None:
        """Give back its memory."""
        GL.glDeleteFramebuffers(2, [self._drawn, self._whole])
        GL.glDeleteRenderbuffers(3, self._stores)


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
            for name, value in (
                (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_COMPARE_MODE, GL.GL_COMPARE_REF_TO_TEXTURE),
            ):
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


def _store(store: int, form: int, width: int, height: int, samples: int) -> None:
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, store)
    GL.glRenderbufferStorageMultisample(GL.GL_RENDERBUFFER, samples if samples > 1 else 0, form, width, height)


def _join(framebuffer: int, *, colour: int, depth: int | None = None) -> None:
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_RENDERBUFFER, colour)
    if depth is not None:
        GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_RENDERBUFFER, depth)
