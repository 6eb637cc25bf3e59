"""Pictures of a camera for a program: colours, depths and camera matrix of one moment, as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.clients.client.session import Latest, NodeClient
from cellwright.middleware.messages.arrays import image_array
from cellwright.middleware.messages.conversions import nanoseconds

_COLOUR, _DEPTH, _INFO = "image_raw", "depth/image_raw", "camera_info"
_KEPT = 4  # moments whose messages have not all come; a message may be lost over ROS


@dataclass(frozen=True, eq=False)
class CameraPicture:
    """Picture of a camera, of one moment. Its arrays are read-only.

    Attributes:
        time_ns: simulation time of the moment [ns].
        frame: name of the optical frame: x to the right, y down, z along the line of sight.
        colour: (height, width, 3), uint8, red, green, blue; None for a camera without colours.
        depth: (height, width), float32 [m] along the line of sight, NaN where nothing was measured; None without depth.
        matrix: camera matrix (3, 3), float64.
    """

    time_ns: int
    frame: str
    colour: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None
    matrix: NDArray[np.float64]

    @property
    def points(self) -> NDArray[np.float32] | None:
        """Return the point of each pixel in the optical frame [m], (height, width, 3), float32; None without depth."""
        if self.depth is None:
            return None
        rows, columns = np.indices(self.depth.shape, np.float32)
        (fx, _, cx), (_, fy, cy) = self.matrix[:2].astype(np.float32)
        return np.stack([(columns - cx) / fx * self.depth, (rows - cy) / fy * self.depth, self.depth], axis=-1)


def picture_topics(camera: str, topics: Mapping[str, str]) -> dict[str, str]:
    """Return the topics of a camera's colours, depths and matrix, by kind; empty if it publishes no pictures."""
    found = {kind: name for kind in (_COLOUR, _DEPTH) if (name := f"{camera}/{kind}") in topics}
    infos = [name for name in (f"{camera}/{_INFO}", f"{camera}/depth/{_INFO}") if name in topics]
    return found | {_INFO: infos[0]} if found and infos else {}


class LatestPicture(Latest):
    """The newest `CameraPicture` of a camera, once all its messages of one moment have come.

    Args:
        client: the client.
        camera: name of the camera's topics, such as `/ariac/over_bin7`.
        topics: topics by kind, from `picture_topics`.
        callback: called with each picture.
    """

    message: CameraPicture | None

    def __init__(
        self,
        client: NodeClient,
        camera: str,
        topics: Mapping[str, str],
        callback: Callable[[CameraPicture], None] | None = None,
    ) -> None:
        self._topics = dict(topics)
        self._callback = callback
        self._partial: dict[int, dict[str, Any]] = {}
        super().__init__(client, camera)

    def _subscribe(self) -> Callable[[], None]:
        leaving = [
            self._session.subscribe(topic, partial(self._take_part, kind), passive=self._callback is None)
            for kind, topic in self._topics.items()
        ]

        def leave() -> None:
            for each in leaving:
                each()

        return leave

    def _take_part(self, kind: str, message: Any) -> None:
        stamp = nanoseconds(message.header.stamp)
        parts = self._partial.setdefault(stamp, {})
        parts[kind] = message
        if len(parts) < len(self._topics):
            if len(self._partial) > _KEPT:
                del self._partial[min(self._partial)]
            return
        self._partial = {time: each for time, each in self._partial.items() if time > stamp}
        matrix = np.array(parts[_INFO].k, np.float64).reshape(3, 3)
        matrix.flags.writeable = False
        colour, depth = (image_array(parts[each]) if each in parts else None for each in (_COLOUR, _DEPTH))
        picture = CameraPicture(stamp, message.header.frame_id, colour, depth, matrix)
        self._take(picture)
        if self._callback is not None:
            self._callback(picture)

    def remember(self) -> Any:
        """Return what has come, for a snapshot."""
        return super().remember(), {stamp: dict(parts) for stamp, parts in self._partial.items()}

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned; None for nothing."""
        latest, incomplete = memory or (None, {})
        super().recall(latest)
        self._partial = {stamp: dict(parts) for stamp, parts in incomplete.items()}
