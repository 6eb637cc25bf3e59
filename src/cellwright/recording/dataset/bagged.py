"""Bags of ROS as episodes of a data set: joint states, commands and recorded pictures at one rate."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from cellwright.clients.operators.bags import COMMANDS, opened_bag
from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND, JOINT_STATES
from cellwright.config.control import side_name
from cellwright.recording.dataset.bag_pictures import BagPictures
from cellwright.recording.dataset.digest import sha256_of
from cellwright.recording.dataset.episode import Column, Episode
from cellwright.recording.dataset.outcomes import outcome_columns
from cellwright.util.errors import UsageError

Values: TypeAlias = dict[str, float]
_Named: TypeAlias = tuple[list[str], list[float]]

_MAX_RATE = 1000  # [Hz]
_NANOSECONDS = 1_000_000_000
_GRIPPER_STATES = "/io_teleop/gripper_states"
_APPLIED = "/io_teleop/applied_joint_cmd"
_SUCTION = "/ariac/gripper/state"
_TYPES = (
    "sensor_msgs/msg/JointState",
    "control_msgs/msg/JointTrajectoryControllerState",
    "osrf_gear/msg/VacuumGripperState",
)


@dataclass(frozen=True)
class _Interface:
    """Topics from which an episode is made: of each group of several the first that is there.

    Attributes:
        robot: kind of the robot.
        states: groups for the state; the first is needed.
        actions: groups for the action; the first is needed.
    """

    robot: str
    states: tuple[tuple[str, ...], ...]
    actions: tuple[tuple[str, ...], ...]

    def fits(self, topics: Mapping[str, Connection]) -> bool:
        """Return whether both needed groups are there."""
        return all(any(name in topics for name in groups[0]) for groups in (self.states, self.actions))


_INTERFACES = (
    _Interface("io_teleop", ((JOINT_STATES,), (_GRIPPER_STATES,)), ((_APPLIED,), (GRIPPER_COMMAND,))),
    _Interface(
        "io_teleop",
        ((JOINT_STATES,), (_GRIPPER_STATES,)),
        ((JOINT_COMMAND,), *((name,) for name in COMMANDS if name != JOINT_COMMAND)),
    ),
    _Interface(
        "ariac",
        (("/ariac/joint_states", "/joint_states"), (_SUCTION,)),
        (("/ariac/arm/state", "/arm_controller/controller_state"), (_SUCTION,)),
    ),
)
"""Interfaces, best first: targets after all limits are what was executed, commands what was asked for."""


def bag_episode(path: str | Path, hz: int = 20, cameras: Sequence[str] = (), *, sentence: str) -> Episode:
    """Return a ROS recording as an episode of a data set: of a robot's node, a cell, or a robot with their topics.

    Nothing is repeated, so values are those of messages, by the times of the bag. The episode begins when all topics
    have had a message. Frame k begins k / hz [s] later; its state is the newest one then, and its action the newest
    command at its end. A joint without a command so far has its measured position.

    Args:
        path: a ROS 1 bag, a ROS 2 bag, or an MCAP file of ROS 2.
        hz: frames in a second [Hz].
        cameras: cameras whose recorded pictures are taken: topics, or parts of them.
        sentence: the task in words.

    Raises:
        UsageError: the bag cannot be read, has no states, no commands or no pictures of a camera, or is too short.

    Example:
        >>> bag_episode("none.bag", sentence="Pick it.")
        Traceback (most recent call last):
        cellwright.util.errors.UsageError: none.bag: cannot be read as a bag: ...
    """
    path = Path(path)
    if not sentence:
        raise UsageError(f"{path}: sentence: a bag has no task that says one; give the task in words")
    if hz != int(hz) or not 0 < hz <= _MAX_RATE:
        raise UsageError(f"hz: must be whole, from 1 to {_MAX_RATE} Hz (got {hz:g})")
    with opened_bag(path) as reader:
        topics = {f"/{each.topic.lstrip('/')}": each for each in reader.connections if each.msgcount}
        interface = _interface_of(path, topics)
        states = _series(path, reader, topics, interface.states)
        actions = _series(path, reader, topics, interface.actions)
        pictures = BagPictures(path, reader, cameras)
        begin = max(states.complete_at({}), actions.complete_at(states.first), pictures.begin)
        # a command stays in force after its message, a state and a picture do not
        end = min(states.messages[-1][0], pictures.end)
        count = (end - begin) * int(hz) // _NANOSECONDS
        if count < 1:
            raise UsageError(f"{path}: has no whole frame in which all topics have values; record a longer one")
        instants = [begin + frame * _NANOSECONDS // int(hz) for frame in range(count + 1)]
        measured = states.at(instants, [{}] * len(instants))
        executed = actions.at(instants, measured)
        films = pictures.films(instants[:-1], int(hz))
    columns = (
        Column("observation.state", _rows(measured, states.names)[:-1], states.names),
        Column("action", _rows(executed, actions.names)[1:], actions.names),
        *outcome_columns(count, ()),
    )
    return Episode(
        source=path.name,
        robot=interface.robot,
        sentence=sentence,
        rate=int(hz),
        columns=columns,
        films=films,
        is_success=False,
        begin=begin / _NANOSECONDS,
        sha256=sha256_of(path),
    )


def _interface_of(path: Path, topics: Mapping[str, Connection]) -> _Interface:
    for interface in _INTERFACES:
        if interface.fits(topics):
            return interface
    known = {name for each in _INTERFACES for name in each.states[0]}
    if known & {*topics}:
        needed = dict.fromkeys(name for each in _INTERFACES for name in each.actions[0])
        raise UsageError(
            f"{path}: has joint states, but nothing says what was executed (got no {', '.join(needed)}); record it too"
        )
    listed = ", ".join(sorted(topics)) or "none"
    raise UsageError(f"{path}: has no joint states on {' or '.join(sorted(known))} (got the topics {listed})")


@dataclass
class _Series:
    """Messages of some topics in the order of their times [ns], as values by name, and the first time of each name."""

    messages: list[tuple[int, Values]] = field(default_factory=list)
    first: dict[str, int] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.first)

    def complete_at(self, others: Mapping[str, int]) -> int:
        """Return the first time at which all names have a value, here or by the first times of others."""
        return max(min(time, others.get(name, time)) for name, time in self.first.items())

    def at(self, instants: Sequence[int], others: Sequence[Values]) -> list[Values]:
        """Return the newest values at each instant; where there is none, that of `others` at the same instant."""
        now: Values = {}
        found, coming = [], iter([*self.messages, (instants[-1] + 1, {})])
        time, values = next(coming)
        for instant, other in zip(instants, others, strict=True):
            while time <= instant:
                now |= values
                time, values = next(coming)
            found.append({**other, **now})
        return found


def _series(
    path: Path, reader: AnyReader, topics: Mapping[str, Connection], groups: Sequence[Sequence[str]]
) -> _Series:
    chosen = [next((name for name in group if name in topics), None) for group in groups]
    connections = {topics[name].topic: name for name in chosen if name is not None}
    found = _Series()
    wanted = [each for each in reader.connections if each.topic in connections]
    if strange := next((each for each in wanted if each.msgtype not in _TYPES), None):
        text = f"must have a type of {', '.join(_TYPES)} (got {strange.msgtype})"
        raise UsageError(f"{path}: {strange.topic}: {text}; leave the topic out")
    for connection, time, data in reader.messages(connections=wanted):
        name = connections[connection.topic]
        names, positions = _READERS.get(name, _joints)(reader.deserialize(data, connection.msgtype))
        if len(names) != len(positions) or not all(map(math.isfinite, positions)):
            at = f"{path}: a message on {name} at {time / _NANOSECONDS:.3f} s"
            raise UsageError(f"{at} needs a finite position for each name; leave the topic or this bag out")
        values = dict(zip(names, positions, strict=True))
        found.messages.append((time, values))
        for each in values:
            found.first.setdefault(each, time)
    return found


def _joints(message: Any) -> _Named:
    """Return names and positions of joint states, or of the desired state of a controller."""
    if hasattr(message, "joint_names"):
        point = message.desired if hasattr(message, "desired") else message.reference  # newer releases of ROS 2
        return [str(each) for each in message.joint_names], [float(each) for each in point.positions]
    return [str(each) for each in message.name], [float(each) for each in message.position]


def _grippers(message: Any) -> _Named:
    """Return how far grippers are closed, by their order; names are ignored, as by the node."""
    positions = [float(each) for each in message.position]
    return [f"gripper_{side_name(number)}" for number in range(len(positions))], positions


def _suction(message: Any) -> _Named:
    return ["suction"], [float(message.enabled)]


_READERS: dict[str, Callable[[Any], _Named]] = {
    _GRIPPER_STATES: _grippers,
    GRIPPER_COMMAND: _grippers,
    _SUCTION: _suction,
}


def _rows(values: Sequence[Values], names: Sequence[str]) -> Any:
    return np.array([[each[name] for name in names] for each in values], np.float32)
