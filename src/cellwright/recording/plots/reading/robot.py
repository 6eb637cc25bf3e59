"""Readers of a robot's plot data: joint states, tip poses, status, and groups of joints."""

from typing import Any

import numpy as np

from cellwright.middleware.messages import from_cdr, to_cdr
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.middleware.messages.standard import JointState, PoseArray
from cellwright.recording.format.format import PANEL
from cellwright.recording.format.reader import RecordedMessage, json_object
from cellwright.recording.plots.reading.reader import SECOND, Spans
from cellwright.recording.plots.tracks import Array, ToolTrack
from cellwright.util.errors import MessageError

_HEAD, _STAMP = 4, 8  # bytes: what CDR begins with, and the time of the message
_LITTLE = b"\x00\x01"


class JointStates:
    """Reads the positions of one topic."""

    def __init__(self, topic: str) -> None:
        self.topics = (topic,)
        self._tables: list[tuple[tuple[str, ...], list[float], list[Array]]] = []  # names, times, positions
        self._before = b""  # what stands between stamp and positions in the message before
        self._count = 0

    def take(self, message: RecordedMessage) -> None:
        """Take the next message; one with other names begins a new table."""
        data = message.data
        begin = _HEAD + _STAMP
        end = begin + len(self._before)
        if not self._before or data[begin:end] != self._before or data[:2] != _LITTLE:  # the first, or another kind
            self._learn(data)
            end = begin + len(self._before)
        if len(data) < end + 8 * self._count:
            raise MessageError("joint states that end in the middle")
        _, times, rows = self._tables[-1]
        times.append(message.time / SECOND)
        rows.append(np.frombuffer(data, "<f8", self._count, end))

    def curves(self) -> dict[str, tuple[Array, Array]]:
        """Times [s] and positions [rad; m] of each joint, in the order in which the joints were named first."""
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
        """Find out where the positions stand, from a message that is read as a whole."""
        message = from_cdr(data, JointState)
        if data[:2] != _LITTLE:
            raise MessageError("joint states in an order of bytes that is not ours")
        if len(message.position) != len(message.name):
            raise MessageError("joint states with other numbers of names and positions")
        count = len(message.position)
        none = np.zeros(0)
        place = len(to_cdr(JointState(message.header, message.name, none, none, none)))
        place -= 8  # how many velocities and efforts
        place += (_HEAD - place) % 8 if count else 0  # what CDR leaves free before numbers of 8 bytes
        self._before, self._count = data[_HEAD + _STAMP : place], count
        names = tuple(message.name)
        if not self._tables or self._tables[-1][0] != names:
            self._tables.append((names, [], []))


_APART = 20_000_000  # poses of the tips are read so far apart [ns]
_SIDES = ("right", "left")


class Tips:
    """Reads /io_teleop/state_ee_poses."""

    topics = ("/io_teleop/state_ee_poses",)

    def __init__(self) -> None:
        self._next = 0
        self._rows: list[tuple[float, list[tuple[float, float, float]]]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next poses."""
        if message.time < self._next:
            return
        self._next = message.time + _APART
        poses = from_cdr(message.data, PoseArray).poses
        at = [(pose.position.x, pose.position.y, pose.position.z) for pose in poses]
        if not self._rows or len(at) == len(self._rows[0][1]):
            self._rows.append((message.time / SECOND, at))

    def tracks(self, arms: list[dict[str, Any]]) -> list[ToolTrack]:
        """The paths of all tips; `arms` says how they are called and in which frame they are."""
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
    """Reads /io_teleop/status: whether commands were taken, and what stood against it."""

    topics = ("/io_teleop/status",)

    def __init__(self) -> None:
        self.safety, self.commander = Spans(), Spans()

    def take(self, message: RecordedMessage) -> None:
        """Take the next status."""
        status, now = from_cdr(message.data, TeleopStatus), message.time / SECOND
        reasons = (
            (status.emergency_stop, "emergency stop"),
            (not status.enabled, "disabled"),
            (status.resetting, "on its way home"),
            (status.silent, "silence: holds"),
        )
        self.safety.add(now, next((word for is_so, word in reasons if is_so), "takes commands"))
        self.commander.add(now, status.commander)


class About:
    """Reads from the first panel that says it how the robot is made up."""

    topics = (PANEL,)

    def __init__(self) -> None:
        self._robot: dict[str, Any] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take what the panel shows next."""
        if not self._robot:
            told = json_object(message.data).get("robot")
            self._robot = told if isinstance(told, dict) else {}

    def groups(self) -> dict[str, list[str]]:
        """Names of the joints of each group; empty where it is not known."""
        try:
            joints = [str(joint["name"]) for joint in self._robot["joints"]]
            return {str(each["name"]): [joints[n] for n in each["joints"]] for each in self._robot["groups"]}
        except (KeyError, TypeError, IndexError):
            return {}

    def grippers(self) -> list[str]:
        """The side that each gripper is on, in their order; empty for one that is alone, and where it is not known."""
        sides = self._robot.get("grippers", [])
        return [str(side) for side in sides] if isinstance(sides, list) else []

    def units(self) -> dict[str, str]:
        """The unit of each joint, by name."""
        try:
            return {str(joint["name"]): str(joint["unit"]) for joint in self._robot["joints"]}
        except (KeyError, TypeError):
            return {}

    def arms(self) -> list[dict[str, Any]]:
        """Name and frame of each arm; empty where it is not known."""
        arms = self._robot.get("arms", [])
        return arms if isinstance(arms, list) and all(isinstance(arm, dict) for arm in arms) else []
