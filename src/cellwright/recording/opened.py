"""Recordings for analysis in Python: messages, frames and arrays, with times in seconds."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import nanoseconds, seconds
from cellwright.recording.dataset.episode import Episode
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import EVENT
from cellwright.recording.format.reader import RecordingFile, recorded_frames
from cellwright.recording.plots.tracks import Span
from cellwright.recording.replay.bodies import held_parts, speeds
from cellwright.recording.replay.distances import BodyDistances, Clearance, Contact
from cellwright.recording.replay.signals import Signals
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_scene
from cellwright.util.errors import MessageError, RecordingError, UnknownNameError

Bodies: TypeAlias = str | Sequence[str]
"""Bodies of a scene: a name, a pattern such as `*_link`, or several of them."""


class Stamped(NamedTuple):
    """A message with its topic and the simulation time [s] at which it was published.

    Example:
        >>> from cellwright.middleware.messages.standard import String
        >>> Stamped(0.5, "/ariac/competition_state", String(data="go")).message.data
        'go'
    """

    time: float
    topic: str
    message: Any


class Recording:
    """An open recording. Use it in a `with`, or close it.

    Example:
        >>> import cellwright
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     path, options = f"{folder}/run.mcap", cellwright.RunOptions(until=0.1)
        ...     result = cellwright.run_trial("lesson", None, record=path, options=options)
        ...     with cellwright.open_recording(path) as recording:
        ...         time, position = recording.arrays("/ariac/joint_states", "position")
        >>> position.shape
        (5, 8)

    Times are simulation times [s]. Readings can be limited: from `start` on, and before `until`.

    Args:
        path: the file, complete or truncated.

    Attributes:
        recording: the underlying reader, with more functions.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """

    def __init__(self, path: str | Path) -> None:
        self.recording = RecordingFile(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self.recording.close()

    @property
    def kind(self) -> str:
        """`cell` or `robot`."""
        return self.recording.header.kind

    @property
    def name(self) -> str:
        """Name of the trial or the robot."""
        return self.recording.header.name

    @property
    def header(self) -> Mapping[str, Any]:
        """Settings of the run, as JSON values: seed, versions, timestep and so on."""
        return self.recording.header.facts

    @property
    def is_complete(self) -> bool:
        """True if it was ended properly. A truncated one is read as far as it goes."""
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
        """Types of the topics that have messages, by name."""
        counts = self.recording.counts
        return {name: topic.type for name, topic in self.recording.topics.items() if counts[name] and not topic.is_own}

    @property
    def result(self) -> Mapping[str, Any] | None:
        """Result of the run, as JSON values; None if the recording is truncated."""
        return self.recording.end

    @property
    def score(self) -> float | None:
        """Score of the run; None if it is not known."""
        score = (self.result or {}).get("score")
        return float(score) if isinstance(score, int | float) else None

    def messages(self, *topics: str, start: float | None = None, until: float | None = None) -> Iterator[Stamped]:
        """Yield the messages of some topics, or of all, in order.

        Raises:
            UnknownNameError: the recording has no such topic.
            RecordingError: the file is damaged, or a type is unknown here.
        """
        for topic in topics:
            if topic not in self.recording.topics:
                raise UnknownNameError("topic", topic, sorted(self.topics))
        found = self.recording.messages(topics or self.topics, start=_time(start), until=_time(until))
        return (Stamped(seconds(each.time), each.topic, self.recording.decode(each)) for each in found)

    def arrays(
        self, topic: str, *fields: str, start: float | None = None, until: float | None = None
    ) -> tuple[NDArray[np.float64], ...]:
        """Return times [s] and a row of numbers a message for each field: `arrays("/ariac/joint_states", "position")`.

        Fields such as `position` or `pose.position.x` have the units of the message.

        Raises:
            UnknownNameError: the recording has no such topic, or its messages no such field.
            RecordingError: a field is not numeric, or its length varies; or the file is damaged.
        """
        times: list[float] = []
        columns: list[list[Any]] = [[] for _ in fields]
        for time, _, message in self.messages(topic, start=start, until=until):
            times.append(time)
            for field, column in zip(fields, columns, strict=True):
                try:
                    column.append(attrgetter(field)(message))
                except AttributeError:
                    names = [name for name in getattr(message, "__dataclass_fields__", ()) if not name.startswith("_")]
                    raise UnknownNameError(f"field of {topic}", field, names) from None
        try:
            return np.array(times), *(np.array(column, np.float64) for column in columns)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"{topic}: fields must be numeric and of constant length: {error}") from None

    def dataset(self, hz: int, pictures: Sequence[str] = ()) -> Episode:
        """Return the run as arrays at one rate: what was measured, what was executed, and what that came to.

        The run is repeated once from its commands, so all values are exact, and pictures are drawn afterwards. Columns
        are those of `recorded_episode`, and `observation.images.NAME` of each camera, which takes height · width · 3
        bytes of memory a frame. `time` of the episode is the time of messages and frames.

        Args:
            hz: frames in a second [Hz]; a frame must be whole ticks.
            pictures: names of colour cameras.

        Raises:
            RecordingError: the recording is truncated or cannot be run again, or its run differs here.
            UsageError: a frame would be no whole number of ticks, or a cell has no arm and no robot.
            UnknownNameError: there is no such camera.
        """
        from cellwright.recording.dataset.recorded import recorded_arrays  # loads the cell

        return recorded_arrays(self.recording, hz, pictures)

    @cached_property
    def scene(self) -> Scene:
        """The scene.

        Raises:
            RecordingError: the recording is truncated before the scene, or damaged there.
        """
        try:
            return decode_scene(self.recording.scene or b"")
        except MessageError as error:
            raise RecordingError(f"{self.recording.path}: {error}") from None

    def frames(self, *, start: float | None = None, until: float | None = None) -> Iterator[SceneFrame]:
        """Yield the poses of all bodies of the scene, 25 times a simulated second.

        Raises:
            RecordingError: the file is damaged.
        """
        return recorded_frames(self.recording, start=_time(start), until=_time(until))

    def path(
        self, body: str, *, start: float | None = None, until: float | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the path of a body, such as `vacuum_gripper_link`.

        Returns:
            Times [s], and world_T_body as x, y, z, qw, qx, qy, qz (n, 7).

        Raises:
            UnknownNameError: the scene has no such body.
            RecordingError: the file is damaged.
        """
        index = self._index(body)
        found = [(frame.time, frame.poses[index]) for frame in self.frames(start=start, until=until)]
        times = np.array([seconds(time) for time, _ in found])
        return times, np.array([pose for _, pose in found], np.float64).reshape(-1, 7)

    def commands(self) -> Iterator[Command]:
        """Yield the external input, in order, refused or not.

        Raises:
            RecordingError: the file is damaged.
        """
        return self.recording.commands()

    def events(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """Yield the referee's events, as times [s] and JSON values: orders, kits, scores with their evidence.

        Raises:
            RecordingError: the file is damaged.
        """
        return ((seconds(time), value) for time, value in self.recording.values(EVENT))

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of all signals, such as `gripper attached` and `agv1 delivering`.

        A boolean field of a message is a signal, and so is each text of a topic of texts.

        Raises:
            RecordingError: the file is damaged.
        """
        return self._signals.names()

    def spans(self, signal: str) -> tuple[Span, ...]:
        """Return the periods in which a signal holds, in order, with `begin`, `end` and `duration` [s].

        They are as exact as the rate of the topic. A period that the recording cuts ends with it.

        Raises:
            UnknownNameError: the recording has no such signal; a text that never occurred is none.
            RecordingError: the file is damaged.
        """
        return self._signals.spans(signal)

    def span(self, signal: str, number: int = 0) -> Span:
        """Return one period of a signal: the first, or another by its number from 0; -1 is the last.

        Raises:
            UnknownNameError: the recording has no such signal.
            RecordingError: the signal has no such period, or the file is damaged.
        """
        found = self.spans(signal)
        if not -len(found) <= number < len(found):
            raise RecordingError(
                f"{self.recording.path}: {signal} has no period {number} (got {len(found)} periods); see spans()"
            )
        return found[number]

    def cycle_times(self, signal: str = "gripper attached") -> NDArray[np.float64]:
        """Return the times [s] from each begin of a signal to the next; empty with fewer than two periods.

        Raises:
            UnknownNameError: the recording has no such signal.
            RecordingError: the file is damaged.
        """
        return np.diff([span.begin for span in self.spans(signal)])

    def held_parts(self) -> tuple[Span, ...]:
        """Return the periods in which the gripper of a cell holds a part; the label is the part's name.

        The part is the body that is nearest to the gripper in the first frame of the period.

        Raises:
            UnknownNameError: the recording has no gripper.
            RecordingError: the file is damaged.
        """
        spans = self.spans("gripper attached")
        begun = [(span, next(self.frames(start=span.begin), None)) for span in spans]
        return held_parts(begun, self.scene, self._distances)

    def clearance(
        self, one: Bodies, other: Bodies | None = None, *, start: float | None = None, until: float | None = None
    ) -> Clearance:
        """Return the least distance between two groups of bodies in the recorded frames.

        Nothing is known of the 40 ms between two frames.

        Args:
            one: a name, a pattern such as `*_link`, or several of them.
            other: the same; None for all bodies that are not in the first group.
            start: from this time [s] on.
            until: before this time [s].

        Raises:
            UnknownNameError: the scene has no such body.
            UsageError: no pair of the two groups can move.
            RecordingError: no frame shows a body of each group, or the file is damaged.
        """
        found = self._distances.clearance(self._some_frames(start, until), *self._groups(one, other))
        if found is None:
            raise RecordingError(
                f"{self.recording.path}: no frame shows both {one} and {other or 'another body'}; check start and until"
            )
        return found

    def contacts(
        self, one: Bodies, other: Bodies | None = None, *, start: float | None = None, until: float | None = None
    ) -> tuple[Contact, ...]:
        """Return the contacts between two groups of bodies in the recorded frames, with `begin` and `end` [s].

        A contact that is over within the 40 ms between two frames is not found. Bodies of which the engine ignores
        contacts, such as neighbouring links, count as others do. Arguments are those of `clearance`.

        Raises:
            UnknownNameError: the scene has no such body.
            UsageError: no pair of the two groups can move.
            RecordingError: there is no frame in these times, or the file is damaged.
        """
        return self._distances.contacts(self._some_frames(start, until), *self._groups(one, other))

    def speed(
        self, body: str, *, start: float | None = None, until: float | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the mean speed of a body's origin between each two frames, while it is in play.

        Returns:
            Times [s] of the later frames, and speeds [m/s].

        Raises:
            UnknownNameError: the scene has no such body.
            RecordingError: the file is damaged.
        """
        return speeds(self.frames(start=start, until=until), self._index(body))

    @cached_property
    def _signals(self) -> Signals:
        return Signals(self.recording)

    @cached_property
    def _distances(self) -> BodyDistances:
        return BodyDistances(self.scene, seen_too=self.kind == "robot")

    def _some_frames(self, start: float | None, until: float | None) -> Iterator[SceneFrame]:
        """Yield frames; none is an error, since an assertion would hold whatever happened."""
        found = False
        for frame in self.frames(start=start, until=until):
            found = True
            yield frame
        if not found:
            raise RecordingError(
                f"{self.recording.path}: no frame in these times (got start {start}, until {until}); "
                f"frames are 40 ms apart, from {self.begin:g} to {self.end:g} s"
            )

    def _groups(self, one: Bodies, other: Bodies | None) -> tuple[frozenset[str], frozenset[str]]:
        """Return the names of two groups of bodies."""
        first = self._distances.select(one)
        rest = frozenset(self._distances.names) - first
        return first, rest if other is None else self._distances.select(other)

    def _index(self, body: str) -> int:
        """Return the index of a body in the scene."""
        if body not in self.scene.bodies:
            raise UnknownNameError("body", body, self.scene.bodies)
        return self.scene.bodies.index(body)


def open_recording(path: str | Path) -> Recording:
    """Open a recording of a run for analysis, in a `with` or until it is closed; see `Recording`, with an example.

    Args:
        path: an `.mcap` file that `--record` wrote.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """
    return Recording(path)


def _time(value: float | None) -> int | None:
    return None if value is None else nanoseconds(value)
