"""Session target that plays a recording."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from cellwright.cell.interface import rows as cell
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.ros1.identity import Identity
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.playback import REPLAY_NODE, AtEnd, Playing, Recorded
from cellwright.recording.replay.services import RecordingServices
from cellwright.robot import interface as robot
from cellwright.running.run.options import RunOptions
from cellwright.running.run.target import RunControls, Served, Target


class PlaybackTarget(Target):
    """A recording that is played.

    Args:
        recording: the recording, or its file, which is closed with the session.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: end of playback: it stops, pauses or repeats.
    """

    acts, stopped = "view the recording", "the recording has ended"
    node: Recorded
    # supplies the time; frames are those of the recording
    identity: Identity | None = Identity(
        REPLAY_NODE, "recording", subscribes=(*cell.SIMULATOR.subscribes, cell.SIMULATOR.frame_source)
    )
    controller_names: Mapping[str, str] = MappingProxyType({**cell.CONTROLLER_NAMES, **robot.CONTROLLER_NAMES})

    def __init__(
        self,
        recording: RecordingFile | Path,
        *,
        first: int | None = None,
        last: int | None = None,
        at_end: AtEnd = AtEnd.STOP,
    ) -> None:
        self._recording, self._first, self._last, self._at_end = recording, first, last, at_end
        self._opened: RecordingFile | None = None

    def open(self, controls: RunControls) -> None:
        """Open the recording at its start."""
        recording = self._recording
        if isinstance(recording, Path):
            recording = self._opened = RecordingFile(recording)
        self.node = Recorded(recording, report=controls.report)
        self._stop = controls.stop
        self.playing = Playing(self.node, controls.rate, first=self._first, last=self._last, at_end=self._at_end)

    def close(self) -> None:
        """Close the file that was opened here."""
        if self._opened is not None:
            self._opened.close()

    def begin(self, _options: RunOptions, _run: ExitStack) -> None:
        """Play up to the last time that a client requests."""
        self._stop.limit(self.playing.last, "time is over")

    def reset(self, *, keeps_clock: bool = False) -> None:  # noqa: ARG002 - its services offer no such reset
        """Go to its start."""
        self.playing.restart()

    def play(self, loop: SimulationLoop) -> None:
        """Play until it is over, or until a request stops it."""
        self.playing.run(loop)

    def offer(self, served: Served) -> None:
        """Offer the services of a server for pages and other viewers."""
        self._services.offer(served.server)

    def panel(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""
        return self._services.panel(request)

    @cached_property
    def _services(self) -> RecordingServices:
        return RecordingServices(self.playing)

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters for the parameter server of ROS 1."""
        return {"use_sim_time": True}
