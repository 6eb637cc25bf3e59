"""Session target that plays a recording."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cellwright.cell.interface import rows as cell
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.ros1.host.ros1 import Identity
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.playback import REPLAY_NODE, AtEnd, Playing, Recorded
from cellwright.recording.replay.services import RecordingServices
from cellwright.robot import interface as robot
from cellwright.running.run.targets import SessionState, Target
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import ExitStack

    from cellwright.recording.format.format import RecordingHeader
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.running.run.options import RecordOptions
    from cellwright.viewer.filming import VideoRecorder

_NO_RECORDING = "record: a recording cannot be recorded again; copy its file"
_NO_VIDEO = "video: a session cannot film a recording; use `cellwright replay FILE --video OUT.mp4`"


class PlaybackTarget(Target):
    """A recording that is played.

    Args:
        recording: the recording, or its file, which is closed with the session.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: whether playback then stops, pauses or repeats.
    """

    acts, stopped, has_end = "view the recording", "the recording has ended", True
    node: Recorded
    # supplies the time; frames are those of the recording
    identity = Identity(REPLAY_NODE, "recording", makes_frames=False)
    controller_names = MappingProxyType({**cell.CONTROLLER_NAMES, **robot.CONTROLLER_NAMES})

    def __init__(
        self,
        recording: RecordingFile | Path,
        *,
        first: int | None = None,
        last: int | None = None,
        at_end: AtEnd = AtEnd.STOP,
    ) -> None:
        super().__init__(lambda: None)
        self._recording, self._first, self._last, self._at_end = recording, first, last, at_end
        self._opened: RecordingFile | None = None

    def open(self, session: SessionState) -> None:
        """Open the recording at its start.

        Raises:
            UsageError: the session is to record or film it.
        """
        if session.record is not None:
            raise UsageError(_NO_RECORDING)
        if session.video is not None:
            raise UsageError(_NO_VIDEO)
        recording = self._recording
        if isinstance(recording, Path):
            recording = self._opened = RecordingFile(recording)
        self.node = Recorded(recording, report=session.report)
        self.playing = Playing(self.node, session.rate, first=self._first, last=self._last, at_end=self._at_end)

    def close(self) -> None:
        """Close the file that was opened here."""
        if self._opened is not None:
            self._opened.close()

    def begin(self, session: SessionState, _run: ExitStack) -> None:
        """Play up to the last time that a client requests."""
        session.stop.limit(self.playing.last, "time is over")

    def reset(self, *, keeps_clock: bool = False) -> None:  # noqa: ARG002 - its services offer no such reset
        """Go to its start."""
        self.playing.restart()

    def pass_time(self, loop: SimulationLoop) -> None:
        """Play until it is over, or until a request stops it."""
        self.playing.run(loop)

    def offer(self, session: SessionState) -> None:
        """Offer the services of a server for pages and other viewers."""
        assert session.server is not None
        self._services.offer(session.server)

    def panel(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""
        return self._services.panel(request)

    def film(self, _options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> VideoRecorder:  # noqa: ARG002
        """Refuse: `cellwright replay` films recordings.

        Raises:
            UsageError: always.
        """
        raise UsageError(_NO_VIDEO)

    def header(self, _session: SessionState, _record: RecordOptions) -> RecordingHeader:
        """Refuse: a recording is not recorded again.

        Raises:
            UsageError: always.
        """
        raise UsageError(_NO_RECORDING)

    @cached_property
    def _services(self) -> RecordingServices:
        return RecordingServices(self.playing)

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters for the parameter server of ROS 1."""
        return {"use_sim_time": True}
