"""Readers of a robot's plot data: joint states, tip poses, status, and groups of joints."""

from typing import Any

import numpy as np

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.middleware.messages.standard import JointState, PoseArray
from cellwright.recording.format.format import PANEL
from cellwright.recording.format.reader import RecordedMessage, json_object
from cellwright.recording.plots.reading.reader import SECOND, Spans
from cellwright.recording.plots.tracks import Array, ToolTrack
from cellwright.util.errors import MessageError

_HEAD, _STAMP = 4, 8  # [bytes], the CDR header and the message's stamp
_LITTLE = b"\x00\x01"
_MIN_PERIOD = 20_000_000  # minimum time between two poses that are read [ns]
_SIDES = ("right", "left")


class JointStateReader:
    """Reader of the positions on one topic."""

    def __init__(self, topic: str) -> None:
        self.topics = (topic,)
        self._tables: list[tuple[tuple[str, ...], list[float], list[Array]]] = []  # names, times, positions
        self._before = b""  # bytes between stamp and positions in the previous message
        self._count = 0

    def take(self, message: RecordedMessage) -> None:
        """Take the next message; one with other names begins a new table."""
        data = message.data
        begin = _HEAD + _STAMP
        end = begin + len(self._before)
        if not self._before or data[begin:end] != self._before or data[:2] != _LITTLE:  # the first, or with other names
            self._learn(data)
            end = begin + len(self._before)
        if len(data) < end + 8 * self._count:
            raise MessageError("joint states end early")
        _, times, rows = self._tables[-1]
        times.append(message.time / SECOND)
        rows.append(np.frombuffer(data, "<f8", self._count, end))

    def curves(self) -> dict[str, tuple[Array, Array]]:
        """Return times [s] and positions [rad; m] of each joint, ordered by the first message that names the joint."""
        found: dict[str, list[tuple[Array, Array]]] = {}
        for names, times, rows in self._tables:
            at, table = np.array(times), np.array(rows)
            for column, name in enumerate(names if len(times) else ()):
                found.setdefault(name, []).append((at, table[:, column]))
        return {
            name: (np.concatenate([at for at, _ in parts]), np.concatenate([values for _, values in parts]))
            for name, parts in found.items()
        }

    def _learn(self, data: bytes) -> None:
        """Locate the positions in the bytes, from a fully decoded message."""
        message = TYPES.from_cdr(data, JointState)
        if data[:2] != _LITTLE:
            raise MessageError("joint states must be little-endian")
        if len(message.position) != len(message.name):
            raise MessageError(
                f"name and position must have the same length (got {len(message.name)} and {len(message.position)})"
            )
        count = len(message.position)
        none = np.zeros(0)
        place = len(TYPES.to_cdr(JointState(message.header, message.name, none, none, none)))
        place -= 8  # the counts of velocities and efforts
        # CDR's padding before numbers of 8 bytes.
        place += (_HEAD - place) % 8 if count else 0
        self._before, self._count = data[_HEAD + _STAMP : place], count
        names = tuple(message.name)
        if not self._tables or self._tables[-1][0] != names:
            self._tables.append((names, [], []))


class Tips:
    """Reader of /io_teleop/state_ee_poses."""

    topics = ("/io_teleop/state_ee_poses",)

    def __init__(self) -> None:
        self._next = 0
        self._rows: list[tuple[float, list[tuple[float, float, float]]]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next poses."""
        if message.time < self._next:
            return
        self._next = message.time + _MIN_PERIOD
        poses = TYPES.from_cdr(message.data, PoseArray).poses
        at = [(pose.position.x, pose.position.y, pose.position.z) for pose in poses]
        if not self._rows or len(at) == len(self._rows[0][1]):
            self._rows.append((message.time / SECOND, at))

    def tracks(self, arms: list[dict[str, Any]]) -> list[ToolTrack]:
        """Return the paths of all tips; `arms` gives their names and frames."""
        if not self._rows or not self._rows[0][1]:
            return []
        times = np.array([time for time, _ in self._rows])
        table = np.array([at for _, at in self._rows])
        found = []
        for place in range(table.shape[1]):
            arm = arms[place] if place < len(arms) else {}
            side = str(arm.get("name", _SIDES[place] if place < len(_SIDES) else place + 1))
            frame = str(arm.get("reference", "the frame of the arms"))
            found.append(ToolTrack(f"{side} tip".strip(), frame, times, table[:, place]))
        return found


class Status:
    """Reader of /io_teleop/status: whether commands were accepted, and what prevented it."""

    topics = ("/io_teleop/status",)

    def __init__(self) -> None:
        self.safety, self.commander = Spans(), Spans()

    def take(self, message: RecordedMessage) -> None:
        """Take the next status."""
        status, now = TYPES.from_cdr(message.data, TeleopStatus), message.time / SECOND
        reasons = (
            (status.emergency_stop, "emergency stop"),
            (not status.enabled, "disabled"),
            (status.resetting, "on its way home"),
            (status.silent, "no commands: holds"),
        )
        self.safety.add(now, next((word for is_so, word in reasons if is_so), "takes commands"))
        self.commander.add(now, status.commander)


class About:
    """Reader of the robot's structure, from the first panel that holds it."""

    topics = (PANEL,)

    def __init__(self) -> None:
        self._robot: dict[str, Any] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next values of the panel."""
        if not self._robot:
            robot = json_object(message.data).get("robot")
            self._robot = robot if isinstance(robot, dict) else {}

    def groups(self) -> dict[str, list[str]]:
        """Return the names of the joints of each group; empty if not known."""
        try:
            joints = [str(joint["name"]) for joint in self._robot["joints"]]
            return {str(each["name"]): [joints[n] for n in each["joints"]] for each in self._robot["groups"]}
        except (KeyError, TypeError, IndexError):
            return {}

    def grippers(self) -> list[str]:
        """Return the side of each gripper, in order; empty for a single gripper, and if not known."""
        sides = self._robot.get("grippers", [])
        return [str(side) for side in sides] if isinstance(sides, list) else []

    def units(self) -> dict[str, str]:
        """Return the unit of each joint, by name."""
        try:
            return {str(joint["name"]): str(joint["unit"]) for joint in self._robot["joints"]}
        except (KeyError, TypeError):
            return {}

    def arms(self) -> list[dict[str, Any]]:
        """Return name and frame of each arm; empty if not known."""
        arms = self._robot.get("arms", [])
        return arms if isinstance(arms, list) and all(isinstance(arm, dict) for arm in arms) else []
