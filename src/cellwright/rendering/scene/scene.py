"""Scenes and frames: shapes on bodies, poses of the bodies, both as bytes, and colours."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.config.layout.views import OVERVIEW
from cellwright.rendering.camera import Camera
from cellwright.util.errors import MessageError, UsageError
from cellwright.util.pose import Pose, Vector3

_FRAME_HEAD = struct.Struct("<BqII")  # whole or changes; time; bodies; entries
_WHOLE, _CHANGES = 0, 1
_FRAME_ENTRY = np.dtype([("body", "<u4"), ("shown", "u1"), ("pose", "<f4", (7,))])
MAX_BODIES = 100_000  # limit for decoded data
_SCENE_FORMAT = 1
MAX_SCENE_BYTES = 256 << 20  # limit of an uncompressed scene


class ShapeType(StrEnum):
    """Form of a shape, and meaning of its `size` [m]; all are centred on the shape's pose."""

    PLANE = "plane"
    """Half the sides along x and y, 0 for an endless one; visible from above."""
    SPHERE = "sphere"
    """Radius."""
    CAPSULE = "capsule"
    """Radius, and half the length of the cylinder between the caps, along z."""
    ELLIPSOID = "ellipsoid"
    """The three radii."""
    CYLINDER = "cylinder"
    """Radius, and half the height along z."""
    BOX = "box"
    """Half the sides."""
    MESH = "mesh"
    """Unused: the mesh has its own size."""


class ShapeLayer(IntEnum):
    """Purpose of a shape."""

    BOTH = 1
    """Seen and touched."""
    LOOKS = 2
    """Seen only."""
    TOUCH = 3
    """Touched only: collision geometry of a body that looks different."""
    MARK = 4
    """Mark for designers of the cell; no picture has it."""


SEEN = frozenset({ShapeLayer.BOTH, ShapeLayer.LOOKS})
"""Layers that are seen."""
TOUCHED = frozenset({ShapeLayer.BOTH, ShapeLayer.TOUCH})
"""Layers that the engine collides."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles: vertices (n, 3) [m] in the frame of the shape, and faces (m, 3), counterclockwise from outside."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class SceneShape:
    """Shape fixed to a body.

    Attributes:
        body: index in `Scene.bodies`; 0 for a static shape.
        form: its form.
        size: its size [m]; see `ShapeType`.
        pose: in the frame of its body.
        colour: red, green, blue and opacity, sRGB 0..1.
        layer: its purpose.
        mesh: index in `Scene.meshes`; None unless the form is MESH.
        static_body: name of the engine's body that a static shape is on, such as `bin7`; `world` for the floor. Empty
            for a shape of a body that moves, and in scenes of older recordings.
    """

    body: int
    form: ShapeType
    size: Vector3
    pose: Pose
    colour: tuple[float, float, float, float]
    layer: ShapeLayer
    mesh: int | None = None
    static_body: str = ""


@dataclass(frozen=True, slots=True)
class Scene:
    """Shapes on bodies.

    Attributes:
        name: of the trial or the robot.
        bodies: unique names of the bodies that may move; the first is "world", which holds all static shapes.
        shapes: the shapes on them.
        meshes: meshes of the shapes.
        views: named views of a cell, `overview` first; empty for that of 2017 and for a robot.

    Example:
        >>> ball = SceneShape(1, ShapeType.SPHERE, (0.1, 0.0, 0.0), Pose(), (1.0, 0.0, 0.0, 1.0), ShapeLayer.BOTH)
        >>> scene = Scene("demo", ("world", "ball"), (ball,), ())
        >>> decode_scene(encode_scene(scene)) == scene
        True
    """

    name: str
    bodies: tuple[str, ...]
    shapes: tuple[SceneShape, ...]
    meshes: tuple[Mesh, ...]
    views: Mapping[str, Camera] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SceneFrame:
    """Poses of the bodies of a scene.

    Attributes:
        time: simulation time [ns].
        poses: (bodies, 7) x, y, z [m] and quaternion w, x, y, z of each body in the world, in the order of
            `Scene.bodies`; float32. The world's own is the identity.
        shown: (bodies,) True if visible; a part that is not in play is not.

    Example:
        >>> poses = np.array([(0, 0, 0, 1, 0, 0, 0), (1, 2, 3, 1, 0, 0, 0)], np.float32)
        >>> frame = SceneFrame(0, poses, np.ones(2, np.bool_))
        >>> frame.pose(1).position
        (1.0, 2.0, 3.0)
        >>> decode_frame(frame.encode()).equals(frame)
        True
    """

    time: int
    poses: NDArray[np.float32]
    shown: NDArray[np.bool_]

    def pose(self, body: int) -> Pose:
        """world_T_body of the body with this index in `Scene.bodies`."""
        x, y, z, qw, qx, qy, qz = self.poses[body].tolist()
        return Pose((x, y, z), (qw, qx, qy, qz))

    def placed(self, body: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from the frame of a body to the world.

        Args:
            body: index in `Scene.bodies`.
            points: (n, 3) [m].
        """
        place, scalar, vector = np.split(self.poses[body].astype(np.float64), (3, 4))
        across = 2 * np.cross(vector, points)
        found: NDArray[np.float64] = points + scalar * across + np.cross(vector, across) + place
        return found

    def equals(self, other: SceneFrame) -> bool:
        """Return whether times, poses and visibility are equal."""
        return (
            self.time == other.time
            and np.array_equal(self.poses, other.poses)
            and np.array_equal(self.shown, other.shown)
        )

    def encode(self, before: SceneFrame | None = None) -> bytes:
        """Encode as bytes.

        Args:
            before: a frame of the same scene that the receiver has; the bytes then hold the changes since it only.
        """
        count = len(self.poses)
        if before is None or len(before.poses) != count:
            kind, bodies = _WHOLE, np.arange(count)
        else:
            changed = (self.poses != before.poses).any(axis=1)
            if self.shown is not before.shown:  # usually the same array
                changed |= self.shown != before.shown
            kind, bodies = _CHANGES, changed.nonzero()[0]
        entries = np.empty(len(bodies), _FRAME_ENTRY)
        entries["body"], entries["shown"], entries["pose"] = bodies, self.shown[bodies], self.poses[bodies]
        return _FRAME_HEAD.pack(kind, self.time, count, len(bodies)) + entries.tobytes()


def decode_frame(data: bytes | memoryview, before: SceneFrame | None = None) -> SceneFrame:
    """Decode a frame; `before` is the previous one, for bytes that hold changes.

    Raises:
        MessageError: the bytes are no frame, or hold changes to a missing frame.
    """
    try:
        kind, time, count, changed = _FRAME_HEAD.unpack_from(data)
        entries = np.frombuffer(data, _FRAME_ENTRY, changed, _FRAME_HEAD.size)
    except (struct.error, ValueError):
        raise MessageError(f"invalid scene frame ({len(data)} bytes)") from None
    if len(data) != _FRAME_HEAD.size + entries.nbytes or count > MAX_BODIES or kind not in (_WHOLE, _CHANGES):
        raise MessageError(f"invalid scene frame ({len(data)} bytes)")
    if kind == _WHOLE:
        is_fitting = np.array_equal(entries["body"], np.arange(count))
    else:
        is_fitting = before is not None and len(before.poses) == count and bool((entries["body"] < count).all())
    if not is_fitting or not np.isfinite(entries["pose"]).all():
        raise MessageError("scene frame does not fit the one before it")
    if kind == _WHOLE or before is None:
        return SceneFrame(time, entries["pose"].copy(), entries["shown"] != 0)
    poses, shown = before.poses.copy(), before.shown.copy()
    poses[entries["body"]] = entries["pose"]
    shown[entries["body"]] = entries["shown"] != 0
    return SceneFrame(time, poses, shown)


def is_whole_frame(data: bytes | memoryview) -> bool:
    """Return whether the bytes of a frame hold all bodies, and need no frame before them."""
    return len(data) >= _FRAME_HEAD.size and data[0] == _WHOLE


def encode_scene(scene: Scene) -> bytes:
    """Encode a scene as bytes."""
    document = {
        "format": _SCENE_FORMAT,
        "name": scene.name,
        "bodies": scene.bodies,
        "shapes": [
            [s.body, s.form, s.size, s.pose.position, s.pose.quaternion, s.colour, s.layer, s.mesh]
            for s in scene.shapes
        ],
        "meshes": [[_base64(mesh.vertices, "<f4"), _base64(mesh.faces, "<i4")] for mesh in scene.meshes],
        "static_bodies": [shape.static_body for shape in scene.shapes],
    }
    if scene.views:
        document["views"] = {name: [view.eye, view.target, view.up, view.fov] for name, view in scene.views.items()}
    return zlib.compress(json.dumps(document).encode(), 6)


def decode_scene(data: bytes) -> Scene:
    """Decode a scene from untrusted bytes.

    Raises:
        MessageError: the bytes are no scene.
    """
    try:
        unpacker = zlib.decompressobj()
        text = unpacker.decompress(data, MAX_SCENE_BYTES)
        if not unpacker.eof:
            raise ValueError("truncated, or too large")
        return _scene(json.loads(text))
    except (zlib.error, ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as fault:
        raise MessageError(f"invalid scene ({len(data)} bytes): {fault}") from None


def _scene(document: dict[str, Any]) -> Scene:
    if document["format"] != _SCENE_FORMAT:
        raise ValueError(f"unknown format {document['format']!r:.20} (known: {_SCENE_FORMAT})")
    meshes = tuple(_mesh(*each) for each in document["meshes"])
    bodies = tuple(document["bodies"])
    if not 1 <= len(bodies) <= MAX_BODIES or not all(isinstance(name, str) for name in bodies):
        raise ValueError(f"bodies must be 1 to {MAX_BODIES} names")
    entries = document["shapes"]
    statics = document.get("static_bodies", [""] * len(entries))  # older scenes have none
    shapes = tuple(
        _shape(entry, len(bodies), len(meshes), str(static)) for entry, static in zip(entries, statics, strict=True)
    )
    views = {str(name): _view(*each) for name, each in document.get("views", {}).items()}
    if views and OVERVIEW not in views:
        raise ValueError(f"views must have one named {OVERVIEW}")
    return Scene(str(document["name"]), bodies, shapes, meshes, views)


def _view(eye: Any, target: Any, up: Any, fov: Any) -> Camera:
    (x, y, z), (at_x, at_y, at_z), (up_x, up_y, up_z) = (map(float, each) for each in (eye, target, up))
    try:
        return Camera((x, y, z), (at_x, at_y, at_z), (up_x, up_y, up_z), float(fov))
    except UsageError as error:
        raise ValueError(str(error)) from None


def _shape(entry: Any, bodies: int, meshes: int, static_body: str) -> SceneShape:
    body, form, size, position, quaternion, colour, layer, mesh = entry
    numbers = np.array([*size, *position, *quaternion, *colour], np.float64)
    if numbers.shape != (14,) or not np.isfinite(numbers).all() or (numbers[:3] < 0).any():
        raise ValueError("shape has invalid numbers")
    known = ShapeType(form)
    if not 0 <= body < bodies or (known is ShapeType.MESH and not 0 <= mesh < meshes):
        raise ValueError("shape has an unknown body or mesh")
    (sx, sy, sz, x, y, z, qw, qx, qy, qz, red, green, blue, opacity) = numbers.tolist()
    return SceneShape(
        body=int(body),
        form=known,
        size=(sx, sy, sz),
        pose=Pose((x, y, z), (qw, qx, qy, qz)),
        colour=(red, green, blue, opacity),
        layer=ShapeLayer(layer),
        mesh=int(mesh) if known is ShapeType.MESH else None,
        static_body="" if body else static_body,
    )


def _base64(array: np.typing.NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode()


def _mesh(vertices: str, faces: str) -> Mesh:
    points = np.frombuffer(base64.b64decode(vertices), "<f4").reshape(-1, 3)
    triangles = np.frombuffer(base64.b64decode(faces), "<i4").reshape(-1, 3)
    if not np.isfinite(points).all() or (triangles < 0).any() or (triangles >= len(points)).any():
        raise ValueError("mesh has invalid vertices or faces")
    return Mesh(points.astype(np.float32), triangles.astype(np.int32))


def linear(colour: NDArray[np.floating]) -> NDArray[np.float32]:
    """Convert sRGB values 0..1 to linear light (IEC 61966-2-1)."""
    c = np.asarray(colour, np.float32)
    return np.where(c <= 0.04045, c / 12.92, ((np.maximum(c, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
