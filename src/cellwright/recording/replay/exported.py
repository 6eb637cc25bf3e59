"""MCAP export for tools such as Foxglove and RViz: topics, and the scene as markers and transforms.

Whoever draws transforms puts a body between the two that are next to the moment. So where a body begins to move, its
last place is said once more for the frame before, or it would seem to glide there for as long as nothing was said of
it; and what comes into play or goes out of it does so at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.messages import to_cdr
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
from cellwright.recording.format.reader import Recording, TimeRange
from cellwright.recording.replay.frame_cursor import Sight
from cellwright.rendering.scene import SEEN, Form, Frame, Scene, Shape
from cellwright.rendering.scene.scene import decode_scene
from cellwright.util.errors import CellwrightError, MessageError, UsageError
from cellwright.util.files import in_its_place
from cellwright.util.pose import Pose
from cellwright.util.pose import Vector3 as Size

_EXPORT_NODE = "/cellwright_export"

MARKERS = RecordedTopic(
    "/cellwright/markers", "visualization_msgs/MarkerArray", rate="once", latch=True, node=_EXPORT_NODE
)
"""The shapes of the scene, each in the frame of its body."""

TRANSFORMS = RecordedTopic("/cellwright/tf", "tf2_msgs/TFMessage", rate="25 Hz", node=_EXPORT_NODE)
"""Where the bodies are."""

WORLD = "world"
"""The frame of what stands still, and the parent of all others."""


def frame_of(body: int, name: str) -> str:
    """The name of a body's frame. The arm's links have frames on `/tf` too, so those here stand apart."""
    return f"cellwright/{name}" if body else WORLD


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


_WHOLE_PERIOD = NANOSECONDS  # simulation time after which everything is said [ns]
_OUT_OF_SIGHT = (0.0, 0.0, -1000.0, 1.0, 0.0, 0.0, 0.0)  # place [m] of what is not shown: markers cannot be hidden


class Transforms:
    """The transforms of one frame after another, of bodies by name, the world first."""

    def __init__(self, bodies: tuple[str, ...]) -> None:
        self._names = [frame_of(body, name) for body, name in enumerate(bodies)]
        self._said = np.full(len(bodies), -1)  # when each was last said [ns]
        self._whole = -_WHOLE_PERIOD
        self._before: Frame | None = None

    def take(self, frame: Frame) -> TFMessage | None:
        """What is to be said of the next frame; None where nothing is, or it is of another scene."""
        if len(frame.poses) != len(self._names):
            return None
        places, before, now = _places(frame), self._before, frame.time
        told = []
        due = np.ones(len(places), np.bool_)
        if before is not None:
            old = _places(before)
            moved = (places != old).any(axis=1)
            jumped = moved & (frame.shown != before.shown)
            begun = moved & ~jumped & (self._said < before.time)
            told += [self._transform(body, old[body], before.time) for body in np.flatnonzero(begun)]
            told += [self._transform(body, old[body], now - 1) for body in np.flatnonzero(jumped)]
            due = moved
        if now - self._whole >= _WHOLE_PERIOD:
            due, self._whole = np.ones(len(places), np.bool_), now
        due[0] = False
        told += [self._transform(body, places[body], now) for body in np.flatnonzero(due)]
        self._said[due] = now
        self._before = frame
        return TFMessage(told) if told else None

    def _transform(self, body: np.intp, place: NDArray[np.float64], time: int) -> TransformStamped:
        x, y, z, qw, qx, qy, qz = place.tolist()
        return transform_stamped(WORLD, self._names[body], Pose((x, y, z), (qw, qx, qy, qz)), time)


def _places(frame: Frame) -> NDArray[np.float64]:
    """Position and quaternion of each body (bodies, 7), far below the floor where it is not shown."""
    places = np.where(frame.shown[:, None], frame.poses.astype(np.float64), _OUT_OF_SIGHT)
    length = np.linalg.norm(places[:, 3:], axis=1, keepdims=True)
    places[:, 3:] = np.where(length > 0.0, places[:, 3:] / np.where(length > 0.0, length, 1.0), _OUT_OF_SIGHT[3:])
    return places


def write_mcap(
    recording: Recording,
    path: Path,
    *,
    start: int | None = None,
    until: int | None = None,
    tell: Callable[[float], None] | None = None,
) -> list[str]:
    """Export a recording; a file that is there already is replaced when the new one is whole.

    It can be looked at, and neither played nor run again by Cellwright: what that needs stays in the recording. A file
    that begins later, at `start` [ns], begins with what is latched then; it goes up to `until` [ns]. `tell` takes now
    and then how far it is, 0..1.

    Returns:
        What is missing in it, and why, in lines.

    Raises:
        RecordingError: the recording is damaged.
        UsageError: there is nothing in it at these times, or the file cannot be written.
    """
    span = TimeRange(recording, start, until)
    try:
        if path.exists() and path.samefile(recording.path):
            raise UsageError(f"{path}: is the recording itself, which is worth more than what is made of it")
        with in_its_place(path) as unfinished:
            unfinished.touch()  # where that fails, the reason is told of the file that was asked for
            failures: list[str] = []
            with McapFile(unfinished, report=failures.append) as file:
                missing = _write(recording, file, span, tell)
            if not file.is_whole:
                raise UsageError(f"{path}: {failures[0].removeprefix(f'{unfinished}: ')}")
    except OSError as error:
        raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
    return missing


def _write(recording: Recording, file: McapFile, span: TimeRange, tell: Callable[[float], None] | None) -> list[str]:
    """Write a part of a recording; what is missing, and why."""
    file.describe(METADATA, recording.header.metadata(EXPORT))
    missing: list[str] = []
    channels: dict[str, int] = {}
    for topic in recording.topics.values():
        if topic.name != FRAME:
            try:
                channels[topic.name] = file.channel(topic)
            except CellwrightError as error:  # a type of a package that is not here
                missing.append(f"{topic.name} is left out: {error}")
    try:
        scene = decode_scene(recording.scene or b"")
    except MessageError as error:
        missing.append(f"what is to be seen is left out: {error}")
        for message in span.messages(channels, tell):
            file.add(channels[message.topic], message.time, message.data)
        return missing
    markers = Markers(scene)
    if markers.left_out:
        missing.append(f"{markers.left_out} meshes are left out: they are too large for markers")
    file.add(file.channel(MARKERS), span.begin, to_cdr(markers.message))
    transforms, channel, sight = Transforms(scene.bodies), file.channel(TRANSFORMS), Sight(recording)
    sight.seek(span.begin - 1)

    def say_frame(time: int) -> None:
        frame = sight.frame()
        said = None if frame is None else transforms.take(replace(frame, time=time))
        if said is not None:
            file.add(channel, time, to_cdr(said))

    say_frame(span.begin)
    for message in span.messages([*channels, FRAME], tell):
        if message.topic == FRAME:
            sight.take(message)
            say_frame(message.time)
        else:
            file.add(channels[message.topic], message.time, message.data)
    return missing
