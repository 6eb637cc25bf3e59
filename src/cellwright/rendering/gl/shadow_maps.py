"""Maps of what light reaches."""

from __future__ import annotations

from typing import Any

from OpenGL import GL

from cellwright.rendering.gl.targets import BETWEEN_TEXELS


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
