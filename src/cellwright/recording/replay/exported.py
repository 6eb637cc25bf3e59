"""MCAP export for tools such as Foxglove and RViz: topics, and the scene as markers and transforms.

These tools interpolate between the two transforms next to the displayed time. So when a body begins to move, its last
pose is repeated for the frame before. Otherwise the body would seem to glide there from its last transform. Bodies that
appear or disappear do so at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import duration, header, pose_message, transform_stamped
from cellwright.middleware.messages.standard import (
    ColorRGBA,
    CompressedImage,
    Marker,
    MarkerArray,
    MeshFile,
    Point,
    TFMessage,
    TransformStamped,
    Vector3,
)
from cellwright.recording.format.format import EXPORT, FRAME, METADATA, RecordedTopic
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile, TimeRange
from cellwright.recording.replay.frame_cursor import FrameCursor
from cellwright.rendering.scene import SEEN, Scene, SceneFrame, SceneShape, ShapeType
from cellwright.rendering.scene.scene import decode_scene
from cellwright.util.errors import CellwrightError, MessageError, UsageError
from cellwright.util.files import replacement_path
from cellwright.util.pose import Pose
from cellwright.util.pose import Vector3 as Size

_EXPORT_NODE = "/cellwright_export"

MARKERS = RecordedTopic(
    "/cellwright/markers", "visualization_msgs/MarkerArray", rate="once", latch=True, node=_EXPORT_NODE
)
"""The shapes of the scene, each in the frame of its body."""

TRANSFORMS = RecordedTopic("/cellwright/tf", "tf2_msgs/TFMessage", rate="25 Hz", node=_EXPORT_NODE)
"""World poses of the bodies."""

WORLD = "world"
"""Fixed frame, and the parent of all others."""

MAX_CORNERS = 1 << 22
"""Maximum number of triangle corners in all markers together, some 100 MB; meshes beyond it are left out."""
_MAX_HALF_SIZE = 30.0  # half the side of an infinite plane [m]
_PLANE_THICKNESS = 0.001  # thickness of a plane [m]: markers have no planes
_UNSCALED: Size = (1.0, 1.0, 1.0)
_NO_BYTES: NDArray[np.uint8] = np.zeros(0, np.uint8)
_WHOLE_PERIOD = NANOSECONDS  # simulation time between full sets of transforms [ns]
_HIDDEN_POSE = (0.0, 0.0, -1000.0, 1.0, 0.0, 0.0, 0.0)  # pose [m] of hidden bodies: markers cannot be hidden


def frame_of(body: int, name: str) -> str:
    """Return the name of a body's frame. The arm's links have frames on `/tf` too, so these have a prefix."""
    return f"cellwright/{name}" if body else WORLD


class Markers:
    """Markers of the visible shapes of a scene.

    The namespace of a marker is its body, so that a tool can hide bodies. Markers are locked to their frames: published
    once, they move with these.

    Attributes:
        message: the markers.
        left_out: number of meshes that are left out, since they are too large.
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

    def _pieces(self, shape: SceneShape) -> Iterator[_Piece]:
        x, y, z = shape.size
        match shape.form:
            case ShapeType.BOX:
                yield _Piece(Marker.CUBE, (2 * x, 2 * y, 2 * z), shape.pose)
            case ShapeType.PLANE:
                size = 2 * (x or _MAX_HALF_SIZE), 2 * (y or _MAX_HALF_SIZE), _PLANE_THICKNESS
                yield _Piece(Marker.CUBE, size, shape.pose @ Pose((0.0, 0.0, -_PLANE_THICKNESS / 2)))
            case ShapeType.SPHERE:
                yield _Piece(Marker.SPHERE, (2 * x, 2 * x, 2 * x), shape.pose)
            case ShapeType.ELLIPSOID:
                yield _Piece(Marker.SPHERE, (2 * x, 2 * y, 2 * z), shape.pose)
            case ShapeType.CYLINDER:
                yield _Piece(Marker.CYLINDER, (2 * x, 2 * x, 2 * y), shape.pose)
            case ShapeType.CAPSULE:
                yield _Piece(Marker.CYLINDER, (2 * x, 2 * x, 2 * y), shape.pose)
                for end in (-y, y):
                    yield _Piece(Marker.SPHERE, (2 * x, 2 * x, 2 * x), shape.pose @ Pose((0.0, 0.0, end)))
            case ShapeType.MESH:
                corners = self._mesh(shape.mesh)
                if corners:
                    yield _Piece(Marker.TRIANGLE_LIST, _UNSCALED, shape.pose, corners)

    def _mesh(self, number: int | None) -> list[Point]:
        """Return the corners of a mesh's triangles, three a triangle; empty if there are too many."""
        assert number is not None
        mesh = self._scene.meshes[number]
        if self._corners + mesh.faces.size > MAX_CORNERS:
            self.left_out += 1
            return []
        self._corners += mesh.faces.size
        if number not in self._points:
            vertices = [Point(*vertex) for vertex in mesh.vertices.astype(np.float64).tolist()]
            self._points[number] = [vertices[index] for index in mesh.faces.reshape(-1).tolist()]
        return self._points[number]


class _Piece(NamedTuple):
    """A shape, or a part of one, as a marker: type, full size [m], pose in the body's frame."""

    type: int
    size: Size
    pose: Pose
    corners: Sequence[Point] = ()


def _marker(number: int, shape: SceneShape, body: str, piece: _Piece) -> Marker:
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


class Transforms:
    """Transforms of successive frames, for bodies by name, the world first."""

    def __init__(self, bodies: tuple[str, ...]) -> None:
        self._names = [frame_of(body, name) for body, name in enumerate(bodies)]
        self._sent_at = np.full(len(bodies), -1)  # time of each body's last transform [ns]
        self._whole = -_WHOLE_PERIOD
        self._before: SceneFrame | None = None

    def take(self, frame: SceneFrame) -> TFMessage | None:
        """Return the transforms of the next frame; None if there are none, or it is of another scene."""
        if len(frame.poses) != len(self._names):
            return None
        places, before, now = _places(frame), self._before, frame.time
        transforms = []
        due = np.ones(len(places), np.bool_)
        if before is not None:
            old = _places(before)
            moved = (places != old).any(axis=1)
            jumped = moved & (frame.shown != before.shown)
            begun = moved & ~jumped & (self._sent_at < before.time)
            transforms += [self._transform(body, old[body], before.time) for body in np.flatnonzero(begun)]
            transforms += [self._transform(body, old[body], now - 1) for body in np.flatnonzero(jumped)]
            due = moved
        if now - self._whole >= _WHOLE_PERIOD:
            due, self._whole = np.ones(len(places), np.bool_), now
        due[0] = False
        transforms += [self._transform(body, places[body], now) for body in np.flatnonzero(due)]
        self._sent_at[due] = now
        self._before = frame
        return TFMessage(transforms) if transforms else None

    def _transform(self, body: np.intp, place: NDArray[np.float64], time: int) -> TransformStamped:
        x, y, z, qw, qx, qy, qz = place.tolist()
        return transform_stamped(WORLD, self._names[body], Pose((x, y, z), (qw, qx, qy, qz)), time)


def _places(frame: SceneFrame) -> NDArray[np.float64]:
    """Return position and quaternion of each body (bodies, 7); hidden bodies are far below the floor."""
    places = np.where(frame.shown[:, None], frame.poses.astype(np.float64), _HIDDEN_POSE)
    length = np.linalg.norm(places[:, 3:], axis=1, keepdims=True)
    places[:, 3:] = np.where(length > 0.0, places[:, 3:] / np.where(length > 0.0, length, 1.0), _HIDDEN_POSE[3:])
    return places


def write_mcap(
    recording: RecordingFile,
    path: Path,
    *,
    start: int | None = None,
    until: int | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> list[str]:
    """Export a recording. An existing file is replaced once the new one is complete.

    Cellwright neither plays nor runs an export again: what that needs stays in the recording.

    Args:
        recording: the recording.
        path: the file to write.
        start: first time [ns]; a file that begins later than the recording begins with the messages that are latched
            then.
        until: last time [ns].
        on_progress: called now and then with the finished share, 0..1.

    Returns:
        A line for each thing that is left out, with the reason.

    Raises:
        RecordingError: the recording is damaged.
        UsageError: there is nothing in it at these times, or the file cannot be written.
    """
    span = TimeRange(recording, start, until)
    try:
        if path.exists() and path.samefile(recording.path):
            raise UsageError(f"{path}: is the recording itself; give another file")
        with replacement_path(path) as unfinished:
            # an error names the requested file, not the unfinished one
            unfinished.touch()
            failures: list[str] = []
            with McapFile(unfinished, report=failures.append, types=recording.types) as file:
                missing = _write(recording, file, span, on_progress)
            if not file.is_whole:
                raise UsageError(f"{path}: {failures[0].removeprefix(f'{unfinished}: ')}")
    except OSError as error:
        raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
    return missing


def _write(
    recording: RecordingFile, file: McapFile, span: TimeRange, on_progress: Callable[[float], None] | None
) -> list[str]:
    """Write a part of a recording; return a line for each thing that is left out."""
    file.describe(METADATA, recording.header.metadata(EXPORT))
    missing: list[str] = []
    channels: dict[str, int] = {}
    for topic in recording.topics.values():
        if topic.name != FRAME:
            try:
                channels[topic.name] = file.channel(topic)
            except CellwrightError as error:
                # a type of a package that is not installed
                missing.append(f"{topic.name} is left out: {error}")
    try:
        scene = decode_scene(recording.scene or b"")
    except MessageError as error:
        missing.append(f"scene is left out: {error}")
        for message in span.messages(channels, on_progress):
            file.add(channels[message.topic], message.time, message.data)
        return missing
    markers = Markers(scene)
    if markers.left_out:
        missing.append(f"{markers.left_out} meshes are left out: they are too large for markers")
    file.add(file.channel(MARKERS), span.begin, TYPES.to_cdr(markers.message))
    transforms, channel, cursor = Transforms(scene.bodies), file.channel(TRANSFORMS), FrameCursor(recording)
    cursor.seek(span.begin - 1)
    # transforms are stamped as the messages are
    offset = recording.header.clock_offset

    def write_frame(time: int) -> None:
        frame = cursor.frame()
        changed = None if frame is None else transforms.take(replace(frame, time=time + offset))
        if changed is not None:
            file.add(channel, time, TYPES.to_cdr(changed))

    write_frame(span.begin)
    for message in span.messages([*channels, FRAME], on_progress):
        if message.topic == FRAME:
            cursor.take(message)
            write_frame(message.time)
        else:
            file.add(channels[message.topic], message.time, message.data)
    return missing
