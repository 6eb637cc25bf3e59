"""Tests of exports: a set that was killed goes on, and has the bytes of an undisturbed one."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cellwright.recording.dataset import export, recorded
from cellwright.recording.dataset.export import export_recordings, unfinished_folder
from cellwright.recording.dataset.frames import frame_instants
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import RecordingError, UsageError
from tests.recording.dataset.made import RATE, actions_around, steered
from tests.support.waiting import TIMEOUT

CAMERA = "overhead"
_KILLED = """
import os, signal, sys
from cellwright.recording.dataset.export import export_recordings

def end(count, frames):
    if count == 2:
        os.kill(os.getpid(), signal.SIGKILL)

export_recordings(sys.argv[2:], sys.argv[1], cameras=["overhead"], on_progress=end)
"""


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recordings")
    actions = actions_around(np.zeros(8, np.float32), 4)
    return [steered(folder / f"run{count}.mcap", actions[:count], count / RATE) for count in (2, 3, 4)]


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def repeated(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the recordings whose runs are repeated."""
    names: list[str] = []
    whole = recorded.recorded_episode

    def counted(path: Path, *arguments: object, **options: object) -> object:
        names.append(path.name)
        return whole(path, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(export, "recorded_episode", counted)
    return names


@pytest.mark.slow
def test_killed_export_goes_on_and_gives_the_same_bytes(
    recordings: list[Path], repeated: list[str], tmp_path: Path
) -> None:
    export_recordings(recordings, tmp_path / "whole", cameras=[CAMERA])
    repeated.clear()
    killed = subprocess.run(
        [sys.executable, "-c", _KILLED, str(tmp_path / "set"), *map(str, recordings)], timeout=TIMEOUT, check=False
    )
    assert killed.returncode == -signal.SIGKILL
    assert not (tmp_path / "set").exists()
    assert unfinished_folder(tmp_path / "set").is_dir()
    export_recordings(recordings, tmp_path / "set", cameras=[CAMERA])
    assert repeated == ["run4.mcap"]
    assert files(tmp_path / "set") == files(tmp_path / "whole")
    assert sorted(os.listdir(tmp_path)) == ["set", "whole"]


def test_run_is_repeated_once_for_readings_and_pictures(
    recordings: list[Path], repeated: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Path] = []

    def noted(recording: RecordingFile, hz: int) -> object:
        begun.append(recording.path)
        return frame_instants(recording, hz)

    monkeypatch.setattr(recorded, "frame_instants", noted)
    export_recordings(recordings[:2], tmp_path / "set", cameras=[CAMERA])
    assert begun == recordings[:2]
    assert repeated == ["run2.mcap", "run3.mcap"]


def test_file_that_is_no_recording_is_refused_before_any_run(
    recordings: list[Path], repeated: list[str], tmp_path: Path
) -> None:
    (tmp_path / "none.mcap").write_bytes(b"nothing")
    with pytest.raises(RecordingError, match=r"none\.mcap"):
        export_recordings([recordings[0], tmp_path / "none.mcap"], tmp_path / "set")
    assert repeated == []
    assert os.listdir(tmp_path) == ["none.mcap"]


def test_folder_that_exists_is_refused_and_nothing_is_left(
    recordings: list[Path], repeated: list[str], tmp_path: Path
) -> None:
    (tmp_path / "set").mkdir()
    with pytest.raises(UsageError, match="exists already"):
        export_recordings(recordings, tmp_path / "set")
    assert repeated == []
    assert os.listdir(tmp_path) == ["set"]


def test_export_that_met_an_error_goes_on_without_what_caused_it(
    recordings: list[Path], repeated: list[str], tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    content = recordings[2].read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    with pytest.raises(RecordingError, match="ends before its run did"):
        export_recordings([recordings[0], cut], tmp_path / "set")
    assert len([*(unfinished_folder(tmp_path / "set") / "episodes").iterdir()]) == 1
    repeated.clear()
    export_recordings(recordings[:2], tmp_path / "set")
    assert repeated == ["run3.mcap"]


def test_recording_twice_in_a_set_is_repeated_once(recordings: list[Path], repeated: list[str], tmp_path: Path) -> None:
    export_recordings([recordings[0], recordings[0]], tmp_path / "set")
    assert repeated == ["run2.mcap"]
