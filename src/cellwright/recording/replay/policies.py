"""Policies in recordings: the reports of an episode, and whether the recorded commands follow from them."""

from __future__ import annotations

from cellwright.cell.cell import Cell
from cellwright.clients.policies.report import TOPIC, ReportCheck, Rules, decode_report
from cellwright.clients.policies.schedule import Chosen
from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.policy_commands import CommandCheck, NodeWatch
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.robot.node import RobotNode
from cellwright.util.errors import CellwrightError


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

    So a latency that was changed shows, though nothing was run with it. Targets of joints are compared, and those of
    the grippers of a robot's node. Where a policy goes in steps, the first commands to a cell tell where it began; at a
    node its messages do.

    Args:
        served: the cell of the recorded run, or the robot's node, before its time passes.

    Attributes:
        fault: the first fault, in a line that names the request; empty if there is none.
    """

    def __init__(self, served: DrawnNode) -> None:
        self.fault = ""
        self._served: Cell | NodeWatch | None = served if isinstance(served, Cell) else None
        if isinstance(served, RobotNode):
            self._served = NodeWatch(served)
        self._reports = ReportCheck(on_silence=self._pass_silent)
        self._commands: CommandCheck | None = None

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
                if not self.fault and self._served is not None and isinstance(rules := decode_report(report), Rules):
                    self._commands = CommandCheck(self._served, rules, command)
            elif self._commands is not None:
                self._commands.check(command, self._reports)
        except CellwrightError as error:
            self.fault = str(error)

    def _pass_silent(self, instant: int, chosen: Chosen) -> None:
        if self._commands is not None:
            self._commands.pass_silent(instant, chosen)
