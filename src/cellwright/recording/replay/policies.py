"""Policies in recordings: the reports of an episode, and whether the recorded commands follow from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.clients.policies.report import TOPIC, ReportCheck, Rules, decode_report
from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages.standard import JointState, JointTrajectory, String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import CellwrightError

_TOLERANCE = 1e-6  # [rad; m] of a target: inverse kinematics may round otherwise on another machine


def policy_reports(recording: RecordingFile) -> list[str]:
    """Return the reports of the policy that a recorded run has asked, as JSON texts; none if there was none.

    Raises:
        RecordingError: the recording is damaged.
    """
    return [text for command in recording.commands() if (text := report_in(command))]


def report_in(command: Command) -> str:
    """Return the report that a command is; empty if it is another one.

    Raises:
        RecordingError: it cannot be decoded.
    """
    if command.kind is not InputKind.PUBLISH or command.name != TOPIC:
        return ""
    message = command.message()
    return message.data if isinstance(message, String) else ""


class EpisodeCheck:
    """Check of an episode: each request is the one that its rules make, and each command is of the action that acts.

    So a latency that was changed shows, though nothing was run with it. The targets of joints are compared; the first
    ones of a policy that goes in steps tell where it began.

    Args:
        cell: the cell of the recorded run; None for a robot's node, of which the requests alone are checked.

    Attributes:
        fault: the first fault, in a line that names the request; empty if there is none.
    """

    def __init__(self, cell: Cell | None) -> None:
        self.fault = ""
        self._cell = cell
        self._reports = ReportCheck(has_commands=cell is not None)
        self._commands: _Commands | None = None

    @property
    def requests(self) -> int:
        """Number of requests so far."""
        return self._reports.requests

    def take(self, command: Command) -> None:
        """Check a command or report of the run, in their order; after a fault nothing more is checked."""
        if self.fault:
            return
        try:
            if report := report_in(command):
                self._reports.take(report)
                self.fault = self._reports.fault
                if not self.fault and self._cell is not None and isinstance(rules := decode_report(report), Rules):
                    self._commands = _Commands(self._cell, rules, command)
            elif self._commands is not None:
                self._commands.check(command, self._reports)
        except CellwrightError as error:
            self.fault = str(error)


class _Commands:
    """Commands of an episode, as its rules make them.

    Args:
        cell: the cell.
        rules: the rules.
        begin: the command with the rules, of the first control instant.
    """

    def __init__(self, cell: Cell, rules: Rules, begin: Command) -> None:
        from cellwright.clients.client.client import Client
        from cellwright.clients.policies.cell_workplace import CellWorkplace
        from cellwright.clients.policies.key_map import default_map
        from cellwright.clients.policies.map_reader import map_of_text
        from cellwright.clients.policies.targets import Targets

        place_of_work = CellWorkplace(Client.in_process(cell))
        names = place_of_work.names
        key_map = map_of_text(rules.map, names) if rules.map else default_map(names)
        self._targets = Targets(key_map, names.space, place_of_work.arms)
        self._begin, self._node = begin.tick, begin.node
        spaces = {each.name: each.namespace for each in cell.trial.layout.robots}
        self._places: dict[str, dict[str, int]] = {}
        for place, channel in enumerate(names.space.channels):
            if channel.kind == "joint":
                arm = f"/ariac/{channel.arm}".rstrip("/")
                topic = f"/{spaces[channel.robot]}/joint_cmd" if channel.robot else f"{arm}/arm/command"
                self._places.setdefault(topic, {})[channel.joint] = place
        self._unknown = {place for places in self._places.values() for place in places.values()}
        self._wanted: list[float] = []
        self._instant, self._request = -1, 0

    def check(self, command: Command, reports: ReportCheck) -> None:
        """Check a command, if it is one of the policy for joints.

        Raises:
            CellwrightError: the action that acts makes another one.
        """
        if command.node != self._node or command.name not in self._places or command.kind is not InputKind.PUBLISH:
            return
        if (instant := command.tick - self._begin) != self._instant:
            acting = reports.action(instant)
            if acting is None:
                raise CellwrightError(
                    f"request {max(0, reports.requests - 1)}: no action acts at tick {instant} (got a command)"
                )
            self._instant, (self._request, action) = instant, acting
            self._wanted = self._targets.take(action)
        for name, position in _positions(command.message()).items():
            place = self._places[command.name].get(name)
            if place is None:
                continue
            if place not in self._unknown and not abs(position - self._wanted[place]) <= _TOLERANCE:
                raise CellwrightError(
                    f"request {self._request}: {name} must go to {self._wanted[place]:.6g} at tick {instant} "
                    f"(got {position:.6g})"
                )
            self._unknown.discard(place)
            self._targets.values[place] = position


def _positions(message: Any) -> Mapping[str, float]:
    """Return the target of each joint in a message to an arm or a robot."""
    if isinstance(message, JointTrajectory) and message.points:
        return dict(zip(message.joint_names, message.points[0].positions, strict=False))
    return dict(zip(message.name, message.position, strict=False)) if isinstance(message, JointState) else {}
