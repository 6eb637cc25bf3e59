"""The shapes of a scene as markers, which RViz, Foxglove and their like draw."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright.middleware.messages.build import duration, header, pose_message
from cellwright.middleware.messages.standard import (
    ColorRGBA,
    CompressedImage,
    Marker,
    MarkerArray,
    MeshFile,
    Point,
    Vector3,
)
from cellwright.recording.replay.exported.names import frame_of
from cellwright.rendering.scene import SEEN, Form, Scene, Shape
from cellwright.util.pose import Pose
from cellwright.util.pose import Vector3 as Size

MOST_CORNERS = 1 << 22
"""Corners of triangles in all markers together, some 100 MB: what is beyond is left out, a mesh at a time."""

_WIDEST = 30.0  # half the side of a plane without end [m]
_THIN = 0.001  # thickness of a plane [m], which markers do not know
_AS_IT_IS: Size = (1.0, 1.0, 1.0)
_NO_BYTES: NDArray[np.uint8] = np.zeros(0, np.uint8)


class Markers:
    """What is to be seen of a scene.

    The namespace of a marker is its body, so that a tool can leave bodies out. Markers are locked to their frames:
    given once, they go where these go.

    Args:
        scene: what is to be seen.

    Attributes:
        message: the markers.
        left_out: how many meshes are not among them, since they would be too large.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._points: dict[int, list[Point]] = {}
        self._corners = 0
        self.left_out = 0
        found: list[Marker] = []
        for shape in scene.shapes:
            if shape.layer in SEEN:
                for piece in self._pieces(shape):
                    found.append(_marker(len(found), shape, scene.bodies[shape.body], piece))
        self.message = MarkerArray(found)  # type: ignore[arg-type]  # the library names an older form of Marker there

    def _pieces(self, shape: Shape) -> Iterator[_Piece]:
        x, y, z = shape.size
        match shape.form:
            case Form.BOX:
                yield _Piece(Marker.CUBE, (2 * x, 2 * y, 2 * z), shape.pose)
            case Form.PLANE:
                size = 2 * (x or _WIDEST), 2 * (y or _WIDEST), _THIN
                yield _Piece(Marker.CUBE, size, shape.pose @ Pose((0.0, 0.0, -_THIN / 2)))
            case Form.SPHERE:
                yield _Piece(Marker.SPHERE, (2 * x, 2 * x, 2 * x), shape.pose)
            case Form.ELLIPSOID:
                yield _Piece(Marker.SPHERE, (2 * x, 2 * y, 2 * z), shape.pose)
            case Form.CYLINDER:
                yield _Piece(Marker.CYLINDER, (2 * x, 2 * x, 2 * y), shape.pose)
            case Form.CAPSULE:
                yield _Piece(Marker.CYLINDER, (2 * x, 2 * x, 2 * y), shape.pose)
                for end in (-y, y):
                    yield _Piece(Marker.SPHERE, (2 * x, 2 * x, 2 * x), shape.pose @ Pose((0.0, 0.0, end)))
            case Form.MESH:
                corners = self._mesh(shape.mesh)
                if corners:
                    yield _Piece(Marker.TRIANGLE_LIST, _AS_IT_IS, shape.pose, corners)

    def _mesh(self, number: int | None) -> list[Point]:
        """The corners of a mesh's triangles, three a triangle; none where there would be too many."""
        assert number is not None
        mesh = self._scene.meshes[number]
        if self._corners + mesh.faces.size > MOST_CORNERS:
            self.left_out += 1
            return []
        self._corners += mesh.faces.size
        if number not in self._points:
            vertices = [Point(*vertex) for vertex in mesh.vertices.astype(np.float64).tolist()]
            self._points[number] = [vertices[index] for index in mesh.faces.reshape(-1).tolist()]
        return self._points[number]


class _Piece(NamedTuple):
    """A shape, or a part of one, in a form that markers have: type, whole size [m], pose in the body's frame."""

    type: int
    size: Size
    pose: Pose
    corners: Sequence[Point] = ()


def _marker(number: int, shape: Shape, body: str, piece: _Piece) -> Marker:
    return Marker(
        header=header(frame_of(shape.body, body)),
        ns=body,
        id=number,
        type=piece.type,
        action=Marker.ADD,
        pose=pose_message(piece.pose),
        scale=Vector3(*piece.size),
        color=ColorRGBA(*shape.colour),
        lifetime=duration(),
        frame_locked=True,
        points=list(piece.corners),
        colors=[],
        texture_resource="",
        texture=CompressedImage(header(), "", _NO_BYTES),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=MeshFile("", _NO_BYTES),
        mesh_use_embedded_materials=False,
    )
