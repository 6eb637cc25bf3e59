"""Observations of a workplace for a policy, from the newest messages of a client, by a key map."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from cellwright.clients.client.pictures import LatestPicture
from cellwright.clients.policies.key_map import (
    SENTENCE,
    Channels,
    Constant,
    Grip,
    KeyMap,
    Numbers,
    Picture,
    Source,
    ToolPose,
    Words,
)
from cellwright.clients.policies.pictures import fitted
from cellwright.clients.policies.rotations import numbers_of
from cellwright.clients.policies.targets import share_of_value
from cellwright.clients.policies.workplace import Workplace
from cellwright.middleware.messages.conversions import nanoseconds


class Observer:
    """Observer of a workplace: it subscribes to what the map uses, and to the state of all channels.

    Args:
        workplace: the cell, or the robot's node.
        key_map: the map.
        sentence: the task.
    """

    def __init__(self, workplace: Workplace, key_map: KeyMap, sentence: str) -> None:
        self._map, self._space, self._arms = key_map, workplace.names.space, workplace.arms
        self._sentence = sentence
        self._cameras = {name: workplace.camera(name) for name in key_map.cameras}
        self._readers = workplace.readers()
        self._latest = list(dict.fromkeys(latest for _, latest in self._readers))

    def is_complete(self) -> bool:
        """Return whether a message of everything has come."""
        return not self.missing()

    def missing(self) -> list[str]:
        """Return the topics of which no message has come."""
        return [each.topic for each in (*self._latest, *self._cameras.values()) if each.message is None]

    def values(self) -> list[float]:
        """Return the newest value of each channel: a position, 1 for suction that is on, a width."""
        return [read() for read, _ in self._readers]

    def exposed(self) -> dict[str, int]:
        """Return the time [ns] of each part of an observation that has one, by its topic."""
        stamped = {each.topic: each for each in self._latest if hasattr(each.message, "header")}
        times = {topic: nanoseconds(each.message.header.stamp) for topic, each in stamped.items()}
        return times | {each.topic: _picture(each).time_ns for each in self._cameras.values()}

    def observation(self) -> dict[str, Any]:
        """Return the observation by the policy's names."""
        values = self.values()
        return {name: self._of(source, values) for name, source in self._map.observation.items()}

    def _of(self, source: Source, values: Sequence[float]) -> Any:
        match source:
            case Picture():
                return self._picture(source)
            case Words(text):
                return text.replace(SENTENCE, self._sentence)
            case tuple():
                return np.concatenate([self._numbers(each, values) for each in source])
            case Channels() | ToolPose() | Grip() | Constant():
                return self._numbers(source, values)
        return {name: self._of(each, values) for name, each in source.items()}

    def _numbers(self, source: Numbers, values: Sequence[float]) -> NDArray[np.float32]:
        match source:
            case Channels(names):
                found: Sequence[float] = [values[self._space.index(name)] for name in names]
            case Constant(numbers):
                found = numbers
            case Grip(name, opened, closed):
                share = share_of_value(self._space.channels[self._space.index(name)], values[self._space.index(name)])
                found = [begin + share * (end - begin) for begin, end in zip(opened, closed, strict=True)]
            case ToolPose(name, rotation, frame):
                arm = self._arms[name]
                pose = arm.base_T_tool(values)
                pose = arm.world_T_base(values) @ pose if frame == "world" else pose
                found = [*pose.position, *numbers_of(pose.quaternion, rotation)]
        return np.array(found, np.float32)

    def _picture(self, source: Picture) -> NDArray[np.uint8]:
        colour = _picture(self._cameras[source.camera]).colour
        assert colour is not None  # maps name cameras with colours
        rows, columns = (-1 if flipped else 1 for flipped in (source.turned, source.turned != source.mirrored))
        turned = colour[::rows, ::columns]
        found = np.ascontiguousarray(turned if source.size is None else fitted(turned, source.size))
        return np.ascontiguousarray(found.transpose(2, 0, 1)) if source.is_planar else found


def digest_of(observation: Mapping[str, Any]) -> str:
    """Return the SHA-256 of an observation, whatever the wire and the order of its names.

    Example:
        >>> digest_of({"a": np.zeros(2, np.float32)}) == digest_of({"a": np.zeros((1, 2), np.float32)})
        False
    """
    digest = hashlib.sha256()
    _feed(digest.update, observation)
    return digest.hexdigest()


def _feed(update: Callable[[bytes], None], value: Any) -> None:
    if isinstance(value, Mapping):
        update(b"{%d" % len(value))
        for name in sorted(value):
            update(msgspec.json.encode(name))
            _feed(update, value[name])
    elif isinstance(value, np.ndarray):
        update(msgspec.json.encode([value.dtype.str, list(value.shape)]))
        update(np.ascontiguousarray(value).tobytes())
    else:
        update(msgspec.json.encode(value))


def _picture(camera: LatestPicture) -> Any:
    assert camera.message is not None  # nothing is observed before `is_complete`
    return camera.message
