import os
import signal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.rendering.video_options import VideoOptions
from cellwright.rendering.views import gear2017_views
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import UsageError
from cellwright.viewer.filming import VideoRecorder
from tests.rendering.worker.test_film import read
from tests.support.quick_children import QUICK_DRAWING

pytestmark = QUICK_DRAWING

TRIAL = load_trial([find_trial("lesson")]).trial


class Filmed:
    """The lesson's script at work for a while, with a video of it."""

    def __init__(
        self, file: Path | None, *, speed: float = 1.0, until: float = 0.8, killed_at: int | None = None
    ) -> None:
        self.cell = Cell(TRIAL)
        self.times: list[float] = []
        self.warnings: list[str] = []
        self.made: dict[str, float | str] = {}
        self._killed_at = killed_at
        at = []
        if file is not None:
            options = VideoOptions(file, speed=speed, size=(64, 48))
            self.film = VideoRecorder(
                self.cell,
                options,
                camera=gear2017_views()["overview"],
                caption=self._caption,
                waits=True,
                warn=self.warnings.append,
            )
            at = [(Fraction(0), lambda _cell: self.film.start())]
        self.hash = run_cell(self.cell, find_agent("lesson")(), RunOptions(until=until, at=at)).state_hash
        if file is not None:
            self.made = self.film.finish()

    def _caption(self) -> str:
        self.times.append(self.cell.simulation.time)
        if len(self.times) == self._killed_at:
            os.kill(self.film._video._worker._process.pid, signal.SIGKILL)
        return f"{self.times[-1]:.1f} s"


@pytest.mark.slow
def test_recorder_takes_frames_at_exact_times_and_leaves_run_unchanged(tmp_path: Path) -> None:
    filmed, plain = Filmed(tmp_path / "a.mp4"), Filmed(None)
    assert filmed.hash == plain.hash
    assert filmed.warnings == []
    assert filmed.times == pytest.approx([n / 25 for n in range(21)], abs=1e-9)
    assert filmed.made == {"file": str(tmp_path / "a.mp4"), "length": 0.84, "frames": 21, "dropped": 0}
    pictures = read(tmp_path / "a.mp4")
    assert len(pictures) == 21
    assert np.abs(pictures[0].astype(int) - pictures[20]).max() > 40  # the arm moves, and so does the clock


@pytest.mark.slow
def test_recorder_at_tenfold_speed_takes_fewer_frames(tmp_path: Path) -> None:
    filmed = Filmed(tmp_path / "a.mp4", speed=10.0)
    assert filmed.times == pytest.approx([0.0, 0.4, 0.8], abs=1e-9)
    assert len(read(tmp_path / "a.mp4")) == 3


@pytest.mark.slow
def test_recorder_below_one_frame_per_tick_is_refused(tmp_path: Path) -> None:
    assert Filmed(tmp_path / "a.mp4", speed=0.05, until=0.02).made["frames"] == 11
    with pytest.raises(UsageError, match=r"speed must be at least 0\.05, one frame per tick \(got 0\.04\)"):
        Filmed(tmp_path / "b.mp4", speed=0.04, until=0.02)
    assert not (tmp_path / "b.mp4").exists()


@pytest.mark.slow
def test_killed_video_is_reported_once_and_run_continues(tmp_path: Path) -> None:
    filmed = Filmed(tmp_path / "a.mp4", killed_at=3)
    assert filmed.hash == Filmed(None).hash
    (warning,) = filmed.warnings
    assert "a.mp4: video is incomplete: render process has ended" in warning
    assert not filmed.film.is_whole
    assert len(filmed.times) < 21  # the dropped frames were not drawn
