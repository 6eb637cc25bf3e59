"""Recorded pictures of a ROS bag as films: the newest of each camera at each instant."""

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from cellwright.recording.dataset.episode import Film
from cellwright.util.errors import UsageError

_RAW, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_CHANNELS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0), "mono8": (0, 0, 0)}
_WIDTHS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}
_ALWAYS = 1 << 62  # [ns]


class BagPictures:
    """Pictures of cameras in a bag.

    Args:
        path: of the bag, for errors.
        reader: the open bag.
        cameras: topics of pictures, or parts of them between slashes, with or without `camera_` in front.

    Attributes:
        begin: first time at which all cameras have had a picture [ns].
        end: time of the last picture of the camera that ends first [ns].

    Raises:
        UsageError: a camera has no topic, or several, or two have the same.
    """

    def __init__(self, path: Path, reader: AnyReader, cameras: Sequence[str]) -> None:
        self._path, self._reader = path, reader
        topics: dict[str, list[Connection]] = {}
        for each in reader.connections:
            if each.msgtype in (_RAW, _COMPRESSED) and each.msgcount:
                topics.setdefault(each.topic, []).append(each)
        self._cameras = {_topic_of(path, camera, topics): camera.strip("/") for camera in cameras}
        if len(self._cameras) < len(cameras):
            raise UsageError(f"{path}: cameras: two name one topic (got {', '.join(cameras)}); name it once")
        self._connections = [each for topic in self._cameras for each in topics[topic]]
        times: dict[str, tuple[int, int]] = {}
        for connection, time, _ in reader.messages(connections=self._connections) if cameras else ():
            times[connection.topic] = (times.get(connection.topic, (time, 0))[0], time)
        self.begin = max((first for first, _ in times.values()), default=-_ALWAYS)
        self.end = min((last for _, last in times.values()), default=_ALWAYS)

    def films(self, instants: Sequence[int], rate: int) -> tuple[Film, ...]:
        """Return the films of the cameras.

        Args:
            instants: times of the frames [ns], none before `begin`.
            rate: frames in a second [Hz].

        Raises:
            UsageError: a picture has an encoding, or a size, that no film has.
        """
        if not self._cameras:
            return ()
        from cellwright.recording.dataset.films import Films  # loads av

        films = Films(self._path.name, [*self._cameras.values()], rate)
        for newest in self._newest(instants):
            films.add({self._cameras[topic]: self._decoded(topic, message) for topic, message in newest.items()})
        return films.finish()

    def _newest(self, instants: Sequence[int]) -> Iterator[Mapping[str, Any]]:
        """Yield the newest message of each camera at each instant, by topic."""
        newest: dict[str, tuple[Connection, Any]] = {}
        coming = self._reader.messages(connections=self._connections)
        connection, time, data = next(coming)
        for instant in instants:
            while time <= instant:
                newest[connection.topic] = connection, data
                connection, time, data = next(coming, (connection, _ALWAYS, b""))
            yield {topic: self._reader.deserialize(data_, each.msgtype) for topic, (each, data_) in newest.items()}

    def _decoded(self, topic: str, message: Any) -> NDArray[np.uint8]:
        if hasattr(message, "format"):
            try:
                with Image.open(io.BytesIO(bytes(message.data))) as picture:
                    return np.asarray(picture.convert("RGB"))
            except (OSError, ValueError, UnidentifiedImageError, Image.DecompressionBombError):
                text = f"a compressed picture cannot be decoded (got {message.format!r:.40}); JPEG and PNG can"
                raise UsageError(f"{self._path}: {topic}: {text}") from None
        width = _WIDTHS.get(message.encoding)
        if width is None:
            text = f"pictures must have one of the encodings {', '.join(_WIDTHS)} (got {message.encoding!r:.40})"
            raise UsageError(f"{self._path}: {topic}: {text}; name a camera of colours")
        if message.step < message.width * width or len(message.data) < message.step * message.height:
            got = f"{len(message.data)} bytes for {message.width} x {message.height}"
            raise UsageError(f"{self._path}: {topic}: a picture lacks pixels (got {got}); leave this bag out")
        rows = np.frombuffer(message.data, np.uint8, message.step * message.height).reshape(message.height, -1)
        pixels = rows[:, : message.width * width].reshape(message.height, message.width, width)
        return np.ascontiguousarray(pixels[..., _CHANNELS[message.encoding]])


def _topic_of(path: Path, camera: str, topics: Mapping[str, Any]) -> str:
    """Return the one topic of a camera's colour pictures."""
    found = [topic for topic in topics if camera.strip("/") == topic.strip("/")] or [
        topic
        for topic in topics
        for parts in [topic.strip("/").split("/")]
        if "depth" not in parts and {camera, f"camera_{camera}"} & {*parts}
    ]
    if len(found) != 1:
        listed = ", ".join(sorted(found or topics)) or "none"
        text = "several topics have pictures of it" if found else "no topic has pictures of it"
        raise UsageError(f"{path}: camera {camera}: {text} (topics of pictures are: {listed}); name one of them")
    return found[0]
