"""Tests of which recording belongs to which run of an evaluation."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import cellwright
from cellwright.running.evaluation.plan.job import EvaluatedTrial, make_jobs
from cellwright.running.evaluation.plan.recordings import Recordings, is_replay
from cellwright.util.errors import UsageError
from tests.running.evaluation.programs import TRIAL


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with recordings of the trial `tiny`, with the seeds 1 and 2."""
    (tmp_path / "tiny.yaml").write_text(TRIAL)
    recordings = tmp_path / "out" / "recordings"
    recordings.mkdir(parents=True)
    for seed in (1, 2):
        with cellwright.Session(str(tmp_path / "tiny.yaml"), seed=seed, record=recordings / f"{seed}.mcap") as session:
            session.run(until=0.01)
    return tmp_path


def test_recording_of_a_run_is_that_of_its_trial_and_seed(folder: Path) -> None:
    for place in (folder / "out", folder / "out" / "recordings"):
        found = Recordings(f"replay:{place}")
        assert found.of("tiny", 2, vary=False) == folder / "out" / "recordings" / "2.mcap"
    with pytest.raises(UsageError, match=r"has no recording of tiny seed 3; record it with `cellwright eval --record`"):
        found.of("tiny", 3, vary=False)
    with pytest.raises(UsageError, match="has no recording of tiny seed 1, varied"):
        found.of("tiny", 1, vary=True)
    with pytest.raises(UsageError, match="has no recording of tiny time_limit=5 seed 1"):
        found.of("tiny time_limit=5", 1, vary=False)


def test_two_recordings_of_a_run_are_refused(folder: Path) -> None:
    recordings = folder / "out" / "recordings"
    shutil.copy(recordings / "1.mcap", recordings / "copy.mcap")
    with pytest.raises(UsageError, match=r"copy\.mcap: is of tiny seed 1, as 1\.mcap is; leave one recording"):
        Recordings(f"replay:{recordings}")
    (recordings / "copy.mcap").write_text("text")
    with pytest.raises(UsageError, match=r"copy\.mcap: "):
        Recordings(f"replay:{recordings}")
    with pytest.raises(UsageError, match="replay:none: there is no such recording or folder"):
        Recordings("replay:none")


def test_each_run_has_its_recording_and_a_key_by_its_content(folder: Path) -> None:
    trial = EvaluatedTrial("tiny", (folder / "tiny.yaml",), 6.0, 6.0, 60.0)
    agent = f"replay:{folder / 'out'}"
    first, second = make_jobs([trial], agent, [1, 2], vary=False)
    assert (first.agent, first.program) == (agent, f"replay:{folder / 'out' / 'recordings' / '1.mcap'}")
    assert f"--agent {second.program} --seed 2" in second.command
    recorded = folder / "out" / "recordings" / "2.mcap"
    alone = f"replay:{recorded}"
    both = make_jobs([trial], alone, [1, 2], vary=False)
    assert [job.program for job in both] == [alone, alone]
    recorded.write_bytes(recorded.read_bytes() + b"\0")
    changed = make_jobs([trial], alone, [1, 2], vary=False)
    assert not {job.key for job in both} & {job.key for job in changed}
    assert is_replay(agent)
    assert not is_replay("my.py:Mine")
