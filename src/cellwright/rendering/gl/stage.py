"""A scene in the memory of whatever draws it: all its triangles in one buffer, and where its bodies are in another."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from cellwright.rendering.scene import SEEN, Form, Frame, Layer, Scene, Shape
from cellwright.rendering.scene.scene import linear
from cellwright.rendering.scene.triangles import Fineness, shape_triangles

_CORNER = np.dtype(
    [("point", "<f4", (3,)), ("normal", "<f4", (3,)), ("colour", "<f4", (4,)), ("body", "<u4"), ("is_plane", "<u4")]
)

_COARSE, _FINE = 20, 48  # corners of a circle
_WIDE = 0.15  # [m], radius above which it has the more of them
_FINENESS = Fineness(
    corners=lambda radius: _FINE if radius > _WIDE else _COARSE,
    endless=60.0,  # far beyond where haze has swallowed it
    breaks_edges=False,
)
_KINDS = 5
_LARGE = 0.08  # [m]


@dataclass(frozen=True, slots=True)
class Part:
    """Some of the triangles: so many indices from the first."""

    first: int
    count: int

    def draw(self) -> None:
        """Draw them with what is bound."""
        if self.count:
            GL.glDrawElements(GL.GL_TRIANGLES, self.count, GL.GL_UNSIGNED_INT, GL.ctypes.c_void_p(4 * self.first))


class Stage:
    """A scene that can be drawn.

    Args:
        scene: what is to be seen.
        layers: which of its shapes.

    Attributes:
        planes: floors; they throw no shadow.
        still: what else stands still.
        moving: what does not.
        large: of what moves, what holds off much of the sky.
        glass: what lets light through; drawn last.
        opaque: the first three.
    """

    def __init__(self, scene: Scene, layers: Collection[Layer] = SEEN) -> None:
        self.scene = scene
        drawn = sorted(
            (shape for shape in scene.shapes if shape.layer in layers), key=lambda shape: _order(shape, scene)
        )
        corners, indices, counts, total = [], [], [0] * _KINDS, 0
        for shape in drawn:
            surface = shape_triangles(shape, scene, _FINENESS)
            kind = _order(shape, scene)
            of_shape = np.zeros(len(surface.points), _CORNER)
            of_shape["point"], of_shape["normal"] = surface.points, surface.normals
            of_shape["colour"] = (*linear(np.array(shape.colour[:3])), shape.colour[3])
            of_shape["body"], of_shape["is_plane"] = shape.body, shape.form is Form.PLANE
            corners.append(of_shape)
            indices.append(surface.faces.reshape(-1) + total)
            counts[kind] += surface.faces.size
            total += len(of_shape)
        firsts = [0, *np.cumsum(counts).tolist()]
        self.planes, self.still, self.large, small, self.glass = map(Part, firsts, counts)
        self.moving = Part(self.large.first, self.large.count + small.count)
        self.opaque = Part(0, self.glass.first)

        self._array = GL.glGenVertexArrays(1)
        self._corners, self._indices, self._bodies = (int(each) for each in GL.glGenBuffers(3))
        self._texture = GL.glGenTextures(1)
        GL.glBindVertexArray(self._array)
        _fill(GL.GL_ARRAY_BUFFER, self._corners, np.concatenate(corners) if corners else np.zeros(0, _CORNER))
        _fill(
            GL.GL_ELEMENT_ARRAY_BUFFER,
            self._indices,
            (np.concatenate(indices) if indices else np.zeros(0)).astype("<u4"),
        )
        for place, name in enumerate(_CORNER.names or ()):
            field, offset = _CORNER[name], GL.ctypes.c_void_p(_offset(name))
            GL.glEnableVertexAttribArray(place)
            if field.base == np.dtype("<u4"):
                GL.glVertexAttribIPointer(place, 1, GL.GL_UNSIGNED_INT, _CORNER.itemsize, offset)
            else:
                GL.glVertexAttribPointer(place, field.shape[0], GL.GL_FLOAT, False, _CORNER.itemsize, offset)

    def show(self, frame: Frame) -> None:
        """Put the bodies where a frame says, and have them drawn from now on."""
        texels: NDArray[np.float32] = np.zeros((len(frame.poses), 8), np.float32)
        texels[:, :3], texels[:, 3] = frame.poses[:, :3], frame.shown
        texels[:, 4:] = frame.poses[:, 3:]
        GL.glBindBuffer(GL.GL_TEXTURE_BUFFER, self._bodies)
        GL.glBufferData(GL.GL_TEXTURE_BUFFER, texels.nbytes, texels, GL.GL_STREAM_DRAW)
        GL.glActiveTexture(GL.GL_TEXTURE0)
        GL.glBindTexture(GL.GL_TEXTURE_BUFFER, self._texture)
        GL.glTexBuffer(GL.GL_TEXTURE_BUFFER, GL.GL_RGBA32F, self._bodies)
        GL.glBindVertexArray(self._array)


def _order(shape: Shape, scene: Scene) -> int:
    if shape.colour[3] < 1.0:
        return 4
    if shape.body:
        return 2 if _extent(shape, scene) > _LARGE else 3
    return 0 if shape.form is Form.PLANE else 1


def _extent(shape: Shape, scene: Scene) -> float:
    """How far a shape reaches at most [m], from its middle."""
    if shape.mesh is not None:
        vertices = scene.meshes[shape.mesh].vertices
        return float(np.abs(vertices).max()) if len(vertices) else 0.0
    return max(shape.size)


def _offset(name: str) -> int:
    assert _CORNER.fields is not None
    return int(_CORNER.fields[name][1])


def _fill(target: int, buffer: int, data: NDArray[np.generic]) -> None:
    GL.glBindBuffer(target, buffer)
    GL.glBufferData(target, data.nbytes, data, GL.GL_STATIC_DRAW)
