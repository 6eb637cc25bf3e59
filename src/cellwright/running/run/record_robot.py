"""Recording a robot's node: what the recording says of itself, and what goes into it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import Any

from cellwright.robot.node import RobotNode
from cellwright.robot.safety import SafetySettings
from cellwright.robot.servos import Motion
from cellwright.running.run.record import RecordOptions, source_attachments, source_facts
from cellwright.running.run.result import versions


@dataclass(frozen=True)
class RobotSettings:
    """What a robot's node was made with besides its robot, as it is needed to make it again.

    Attributes:
        motion: how targets are reached.
        timestep: length of a step of physics [s].
        self_collision: whether links may touch each other.
        safety: what is guarded against.
        node: its name.
        sim_time: whether messages carry simulation time.
        driver: whether something else than the simulation moves it; then no run comes about again.
    """

    motion: Motion
    timestep: Fraction
    self_collision: bool
    safety: SafetySettings
    node: str
    sim_time: bool
    driver: bool

    def facts(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "motion": self.motion.value,
            "timestep": [self.timestep.numerator, self.timestep.denominator],
            "self_collision": self.self_collision,
            "safety": {**asdict(self.safety), "guard": self.safety.guard.value},
            "node": self.node,
            "sim_time": self.sim_time,
            "driver": self.driver,
        }


class RobotRecording:
    """A robot's node that is being recorded.

    Args:
        node: the node, whose time has not begun.
        options: how it is recorded.
        settings: what the node was made with.

    Raises:
        UsageError: a file cannot be opened.
    """

    def __init__(self, node: RobotNode, options: RecordOptions, settings: RobotSettings) -> None:
        from cellwright.recording.format.files import RecordingFiles  # they load a good deal
        from cellwright.recording.format.format import RecordingHeader
        from cellwright.recording.format.recorder import Recorder
        from cellwright.viewer.services.robot_panel import RobotPanel

        facts = {
            "versions": versions(),
            "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
            **options.about,
            **settings.facts(),
            **source_facts(options),
        }
        panel = RobotPanel(node)
        self._files = RecordingFiles(options.paths, report=options.report)
        self._recorder = Recorder(
            node,
            self._files.path,
            RecordingHeader("robot", node.name, facts),
            attachments=source_attachments(options),
            panel=lambda: panel.tell({}),
            stamp=lambda: node.arrived,
            report=options.report,
        )

    @property
    def is_whole(self) -> bool:
        """Whether everything is in the files that were asked for."""
        return self._recorder.is_whole and self._files.is_whole

    @property
    def files(self) -> list[Path]:
        """The files that were written."""
        return self._files.written

    def end(self, result: Mapping[str, Any] | None = None) -> None:
        """The node has stopped; without a result it was broken off. Again is no error."""
        if not self._recorder.is_over:
            self._recorder.end(result or {"outcome": "broken off"})
            self._files.finish(self._recorder.paths)
