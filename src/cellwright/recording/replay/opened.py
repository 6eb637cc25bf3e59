"""A recording in the hands of somebody who reckons with it: messages, frames and arrays, with times in seconds."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import nanoseconds, seconds
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import EVENT
from cellwright.recording.format.reader import Recording, recorded_frames
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.scene.scene import decode_scene
from cellwright.util.errors import MessageError, RecordingError, UnknownNameError


class Stamped(NamedTuple):
    """A message, the topic that it went by, and the simulation time [s] at which it did."""

    time: float
    topic: str
    message: Any


class OpenedRecording:
    """A recording, opened. Use it in a `with`, or close it.

    Times are simulation times [s]; what is read can be bounded, from `start` on and before `until`.

    Args:
        path: the file, whole or cut short.

    Attributes:
        recording: the file as it is, for what is not here.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """

    def __init__(self, path: str | Path) -> None:
        self.recording = Recording(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Read no more."""
        self.recording.close()

    @property
    def kind(self) -> str:
        """What was recorded: `cell` or `robot`."""
        return self.recording.header.kind

    @property
    def name(self) -> str:
        """Of the trial or the robot."""
        return self.recording.header.name

    @property
    def header(self) -> Mapping[str, Any]:
        """What the run depended on, as JSON values: seed, versions, timestep and so on."""
        return self.recording.header.facts

    @property
    def is_complete(self) -> bool:
        """Whether it was ended as it should be. One that was cut short is read as far as it goes."""
        return self.recording.is_complete

    @property
    def begin(self) -> float:
        """Simulation time of its begin [s]."""
        return seconds(self.recording.begin)

    @property
    def end(self) -> float:
        """Simulation time of its end [s]."""
        return seconds(self.recording.end_time)

    @property
    def topics(self) -> dict[str, str]:
        """Types of the topics on which something was said, by name."""
        counts = self.recording.counts
        return {name: topic.type for name, topic in self.recording.topics.items() if counts[name] and not topic.is_own}

    @property
    def result(self) -> Mapping[str, Any] | None:
        """What came of the run, as JSON values; None where it was cut short."""
        return self.recording.end

    @property
    def score(self) -> float | None:
        """What the run earned; None where that is not known."""
        score = (self.result or {}).get("score")
        return float(score) if isinstance(score, int | float) else None

    def messages(self, *topics: str, start: float | None = None, until: float | None = None) -> Iterator[Stamped]:
        """The messages of some topics, or of all, in order.

        Raises:
            UnknownNameError: the recording has no such topic.
            RecordingError: the file is damaged, or a type is not known here.
        """
        for topic in topics:
            if topic not in self.recording.topics:
                raise UnknownNameError("topic", topic, sorted(self.topics))
        found = self.recording.messages(topics or self.topics, start=_time(start), until=_time(until))
        return (Stamped(seconds(each.time), each.topic, self.recording.decode(each)) for each in found)

    def arrays(
        self, topic: str, *fields: str, start: float | None = None, until: float | None = None
    ) -> tuple[NDArray[np.float64], ...]:
        """Times [s], and a row of numbers a message for each field: `arrays("/ariac/joint_states", "position")`.

        Fields such as `position` or `pose.position.x` are in the units of the message.

        Raises:
            UnknownNameError: the recording has no such topic, or its messages no such field.
            RecordingError: a field is not numbers, as many in each message; or the file is damaged.
        """
        times: list[float] = []
        columns: list[list[Any]] = [[] for _ in fields]
        getters = [attrgetter(field) for field in fields]
        for time, _, message in self.messages(topic, start=start, until=until):
            times.append(time)
            for field, getter, column in zip(fields, getters, columns, strict=True):
                try:
                    column.append(getter(message))
                except AttributeError:
                    names = [name for name in getattr(message, "__dataclass_fields__", ()) if not name.startswith("_")]
                    raise UnknownNameError(f"field of {topic}", field, names) from None
        try:
            return np.array(times), *(np.array(column, np.float64) for column in columns)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"{topic}: its fields are no rows of numbers: {error}") from None

    @cached_property
    def scene(self) -> Scene:
        """What there is to be seen.

        Raises:
            RecordingError: it was cut before that, or is damaged there.
        """
        try:
            return decode_scene(self.recording.scene or b"")
        except MessageError as error:
            raise RecordingError(f"{self.recording.path}: {error}") from None

    def frames(self, *, start: float | None = None, until: float | None = None) -> Iterator[Frame]:
        """Where all bodies of the scene are, 25 times a simulated second.

        Raises:
            RecordingError: the file is damaged.
        """
        return recorded_frames(self.recording, start=_time(start), until=_time(until))

    def path(
        self, body: str, *, start: float | None = None, until: float | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where a body went, such as `vacuum_gripper_link`: times [s], and world_T_body as x, y, z, qw, qx, qy, qz.

        Raises:
            UnknownNameError: the scene has no such body.
            RecordingError: the file is damaged.
        """
        bodies = self.scene.bodies
        if body not in bodies:
            raise UnknownNameError("body", body, bodies)
        index = bodies.index(body)
        found = [(frame.time, frame.poses[index]) for frame in self.frames(start=start, until=until)]
        times = np.array([seconds(time) for time, _ in found])
        return times, np.array([pose for _, pose in found], np.float64).reshape(-1, 7)

    def commands(self) -> Iterator[Command]:
        """What came from outside, in order, refused or not.

        Raises:
            RecordingError: the file is damaged.
        """
        return self.recording.commands()

    def events(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """What the referee did, as JSON values with their times [s]: orders, kits, scores with their evidence.

        Raises:
            RecordingError: the file is damaged.
        """
        return ((seconds(time), value) for time, value in self.recording.values(EVENT))


def open_recording(path: str | Path) -> OpenedRecording:
    """A recording of a run, to reckon with: see `OpenedRecording`.

    Args:
        path: what `--record` wrote, an `.mcap`.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """
    return OpenedRecording(path)


def _time(value: float | None) -> int | None:
    return None if value is None else nanoseconds(value)
