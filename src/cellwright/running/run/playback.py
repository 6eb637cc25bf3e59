"""Session target that plays a recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.ros1.host.ros1 import Identity
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.playback import REPLAY_NODE, AtEnd, Playing, Recorded
from cellwright.recording.replay.services import RecordingServices
from cellwright.running.run.targets import SessionState, Target
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from contextlib import ExitStack


class PlaybackTarget(Target):
    """A recording that is played.

    Args:
        recording: the recording, or its file, which is closed with the session.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: whether playback then stops, pauses or repeats.
    """

    acts, stopped, has_end = "see the recording", "the recording is over", True
    node: Recorded
    # supplies the time; frames are those of the recording
    identity = Identity(REPLAY_NODE, "recording", makes_frames=False)

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
            raise UsageError("record: a recording is not recorded again; copy its file")
        if session.video is not None:
            raise UsageError("video: a session films no recording; use `cellwright replay FILE --video OUT.mp4`")
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

    def reset(self) -> None:
        """Go to its start."""
        self.playing.restart()

    def pass_time(self, loop: SimulationLoop) -> None:
        """Play until it is over, or until a request stops it."""
        self.playing.run(loop)

    def offer(self, session: SessionState) -> None:
        """Offer the services of a server for pages and other viewers."""
        assert session.server is not None
        RecordingServices(self.playing).offer(session.server)

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters for the parameter server of ROS 1."""
        return {"use_sim_time": True}
