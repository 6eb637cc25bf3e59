"""Joints of an assembled robot, by index and by name, and their index table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Generic, Iterable, Mapping, NamedTuple, Sequence, TypeVar, Union

from cellwright.clients.assembled import process as services
from cellwright.clients.assembled.process import RobotProcess
from cellwright.util.errors import UnknownNameError, UsageError

Pose = Sequence[Sequence[float]]
"""A pose as lists: [[x, y, z], [qx, qy, qz, qw]], in metres."""

Numbers = Union[float, Iterable[float]]
Indices = Union[int, Iterable[int]]

T = TypeVar("T")
_TABLE_HEAD = ("index", "joint", "type", "link", "parent link", "from", "to")


class JointStates(NamedTuple):
    """State of all joints that are not fixed, in the order of their indices: the fields of a `sensor_msgs/JointState`.

    Names are as in the URDF, positions in rad or m, velocities in rad/s or m/s, efforts in N m or N.
    """

    names: list[str]
    positions: list[float]
    velocities: list[float]
    efforts: list[float]


@dataclass(frozen=True)
class JointInfo:
    """A joint as the index table shows it; `link` is its child link, and has the same index.

    Limits are infinite where the URDF sets none [rad; m; N m; N; rad/s; m/s].
    """

    index: int
    name: str
    type: str
    link: str
    parent: str
    lower: float
    upper: float
    effort: float
    velocity: float
    is_driven: bool


class Lookup(dict, Generic[T]):  # type: ignore[type-arg]
    """A dictionary whose error for a missing key lists its keys; `kind` is the name of a key in that error."""

    def __init__(self, kind: str, entries: Mapping[Any, T]) -> None:
        super().__init__(entries)
        self._kind = kind

    def __missing__(self, key: object) -> T:
        raise UnknownNameError(self._kind, str(key), map(str, self))


class RobotJoints:
    """The joints of a robot, described, driven and read through its process."""

    def __init__(self, process: RobotProcess, described: Mapping[str, Any]) -> None:
        self._process = process
        self.table = [_joint(row) for row in described["joints"]]
        self._movable = [joint for joint in self.table if joint.type != "fixed"]
        self.movable = [joint.index for joint in self._movable]  # indices of joints that are not fixed
        self._links = {joint.link: joint.index for joint in self.table}
        self._places = {joint.index: place for place, joint in enumerate(self._movable)}

    def move(self, indices: Indices, positions: Numbers) -> None:
        """Move joints to positions [rad; m]."""
        self._command(services.MOVE_SERVICE, indices, positions)

    def place(self, indices: Indices, positions: Numbers) -> None:
        """Put joints at positions [rad; m] at once."""
        self._command(services.PLACE_SERVICE, indices, positions)

    def states(self) -> JointStates:
        """Return the state of all joints that are not fixed."""
        state = self._process.ask(services.STATE_SERVICE)
        names = [joint.name for joint in self._movable]
        return JointStates(names, state["positions"], state["velocities"], state["efforts"])

    def positions(self, indices: Iterable[int]) -> list[float]:
        """Return the present positions of some joints [rad; m]."""
        state = self._process.ask(services.STATE_SERVICE)["positions"]
        return [state[self._places[index]] for index in indices]

    def link_poses(self, indices: Sequence[int], frame: int | None = None) -> list[Pose]:
        """Return the present poses of link frames, in the world or in the frame of a link; -1 is the root link."""
        poses: list[Pose] = self._process.ask(services.STATE_SERVICE, links=list(indices), frame=frame)["links"]
        return poses

    def link_index(self, name: str) -> int:
        """Return the index of a link; -1 for the root link."""
        return self._links.get(name, -1)

    def range_of(self, index: int) -> tuple[float, float]:
        """Return the limits of a joint [rad; m]."""
        joint = self.table[index]
        return joint.lower, joint.upper

    def _command(self, service: str, indices: Indices, positions: Numbers) -> None:
        chosen, values = _listed(indices), _listed(positions)
        if len(chosen) != len(values):
            raise UsageError(f"indices and positions must have the same length (got {len(chosen)} and {len(values)})")
        for index in chosen:
            self._check(index)
        numbers = [float(value) for value in values]
        if not all(map(math.isfinite, numbers)):
            raise UsageError(f"positions must be finite (got {numbers})")
        if chosen:
            self._process.ask(service, joints=[int(index) for index in chosen], positions=numbers)

    def _check(self, index: Any) -> None:
        count = len(self.table)
        if isinstance(index, (bool, float, str)) or not 0 <= index < count:
            raise UsageError(f"joint index {index!r}: must be from 0 to {count - 1}")
        joint = self.table[index]
        if not joint.is_driven:
            raise UsageError(f"joint {index}, {joint.name}, cannot move: its type is {joint.type}")


def _listed(value: Any) -> list[Any]:
    """Return one number or several as a list; arrays of numpy too."""
    try:
        return list(value)
    except TypeError:
        return [value]


def _joint(row: Mapping[str, Any]) -> JointInfo:
    """Return a joint of the description, where None stands for no limit."""
    unlimited = {"lower": -math.inf, "upper": math.inf, "effort": math.inf, "velocity": math.inf}
    found: dict[str, Any] = {key: unlimited.get(key) if value is None else value for key, value in row.items()}
    return JointInfo(**found)


def index_table(joints: Iterable[JointInfo]) -> str:
    """Return the index table: a line per joint, fixed ones included; missing limits [rad; m] are empty."""
    rows = [_TABLE_HEAD, *map(_table_row, joints)]
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def _table_row(joint: JointInfo) -> tuple[str, ...]:
    bounds = [
        f"{value:.4g}" if joint.is_driven and math.isfinite(value) else "" for value in (joint.lower, joint.upper)
    ]
    return (str(joint.index), joint.name, joint.type, joint.link, joint.parent, *bounds)
