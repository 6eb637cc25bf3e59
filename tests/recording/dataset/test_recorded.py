"""Recorded episodes: what an environment sees and does with the same actions, and refusals."""

from __future__ import annotations

import hashlib
import math
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cellwright
from cellwright import RunOptions, Session
from cellwright.envs.cell_env import CellEnv
from cellwright.middleware.messages.conversions import joint_state
from cellwright.recording.dataset.episode import Episode
from cellwright.recording.dataset.films import Films
from cellwright.recording.dataset.recorded import recorded_arrays, recorded_episode
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.run import cell_result
from cellwright.util.errors import UnknownNameError, UsageError
from tests.cell.tasks.cells import BASE
from tests.recording.dataset.made import RATE, SEED, TASK, actions_around, kitted, steered

FRAMES = 8
CAMERA = "overhead"


def values(episode: Episode) -> dict[str, Any]:
    return {column.name: column.values for column in episode.columns}


def observed(*cameras: str) -> list[dict[str, Any]]:
    """Return what an environment observes: before each action, and after the last; the first one holds the actions."""
    with closing(CellEnv(TASK, cameras=cameras)) as env:
        found = [env.reset(seed=SEED, options={"variation": False})[0]]
        found[0]["actions"] = actions_around(found[0]["agent_pos"], FRAMES)
        return found + [env.step(action)[0] for action in found[0]["actions"]]


@pytest.fixture(scope="module")
def seen() -> list[dict[str, Any]]:
    return observed()


@pytest.fixture(scope="module")
def path(seen: list[dict[str, Any]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return steered(tmp_path_factory.mktemp("steered") / "run.mcap", seen[0]["actions"], FRAMES / RATE)


def test_columns_are_those_of_an_environment_bit_for_bit(seen: list[dict[str, Any]], path: Path) -> None:
    episode = recorded_episode(path, RATE)
    assert (episode.source, episode.robot, episode.rate) == ("run.mcap", "cellwright_ur10", 20)
    assert episode.sentence == "Pick up a gear from the bin."
    assert episode.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    found = values(episode)
    assert found["observation.state"].dtype == found["action"].dtype == np.float32
    assert found["observation.state"].tolist() == [each["agent_pos"].tolist() for each in seen[:-1]]
    assert found["action"].tolist() == [each.tolist() for each in seen[0]["actions"]]
    with closing(CellEnv(TASK)) as env:
        assert episode.columns[0].names == episode.columns[1].names == env.agent_pos_names
    assert episode.columns[0].units == episode.columns[1].units == ("m", *["rad"] * 6, "")


def test_episode_that_the_recording_ends_is_truncated(path: Path) -> None:
    episode = recorded_episode(path, RATE)
    found = values(episode)
    assert not episode.is_success
    assert found["next.reward"].shape == (FRAMES,)
    last = [False] * (FRAMES - 1) + [True]
    assert (found["next.done"].tolist(), found["next.truncated"].tolist()) == (last, last)
    assert not found["next.success"].any()


@pytest.mark.slow
def test_pictures_are_those_of_an_environment(path: Path) -> None:
    with RecordingFile(path) as recording:
        drawn = recorded_arrays(recording, RATE, [CAMERA]).column(f"observation.images.{CAMERA}").values
    expected, films = observed(CAMERA)[:-1], Films("run.mcap", [CAMERA], RATE)
    assert len(drawn) == FRAMES
    assert drawn.dtype == np.uint8
    for picture, each in zip(drawn, expected, strict=True):
        assert np.array_equal(picture, each["pixels"][CAMERA])
        films.add(each["pixels"])
    [film], [wanted] = recorded_episode(path, RATE, [CAMERA]).films, films.finish()
    assert (film.camera, film.frames, film.video) == (CAMERA, FRAMES, wanted.video)
    assert film.statistics.as_lists() == wanted.statistics.as_lists()


def test_cameras_without_the_package_for_videos_are_refused(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.recording.dataset.recorded.is_installed", lambda name: name != "av")
    with pytest.raises(UsageError, match=r"^cameras: videos need the package av; pip install 'cellwright\[video\]'$"):
        recorded_episode(path, RATE, [CAMERA])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_actions_of_the_kitter_succeed_in_an_environment(seed: int, tmp_path: Path) -> None:
    episode = recorded_episode(kitted(tmp_path / "run.mcap", seed), RATE)
    found = values(episode)
    assert episode.is_success
    assert found["next.reward"][-1] == 1.0
    assert (found["next.success"].sum(), found["next.done"].sum(), found["next.truncated"].sum()) == (1, 1, 0)
    with closing(CellEnv(TASK)) as env:
        observation, info = env.reset(seed=seed, options={"variation": False})
        assert found["observation.state"][0].tolist() == observation["agent_pos"].tolist()
        for action in found["action"]:
            *_, info = env.step(action)
            if info["is_success"]:
                break
    assert info["is_success"]


def test_arrays_need_no_task_and_keep_the_time_of_the_run(tmp_path: Path) -> None:
    start, path = tmp_path / "later.checkpoint", tmp_path / "run.mcap"
    cellwright.run_trial("lesson", None, options=RunOptions(until=0.1, checkpoints=[(Fraction(1, 10), start)]))
    cellwright.run_trial("lesson", None, record=path, options=RunOptions(until=0.3, start=start))
    with RecordingFile(path) as recording:
        episode = recorded_arrays(recording, RATE, ())
    assert (episode.sentence, episode.films) == ("", ())
    assert episode.time.tolist() == pytest.approx([0.1, 0.15, 0.2, 0.25])
    assert episode.column("next.reward").values.tolist() == [0.0] * 4


class Waits:
    """Waits for the end."""

    def run(self, client: cellwright.Client) -> None:
        """Wait."""
        client.sleep(100.0)


def test_episode_ends_with_the_first_success(tmp_path: Path) -> None:
    path, file = tmp_path / "run.mcap", tmp_path / "trial.yaml"
    file.write_text(f"{BASE}task: {{sentence: Do it., hold_for: 0.2, success: {{discarded: {{tray: tray1}}}}}}\n")
    with Session(file, record=path, options=RunOptions(until=1.0, ends_when_done=False)) as session:
        result = cell_result(session.run(Waits()))
    assert result.succeeded_at is not None
    found = values(recorded_episode(path, RATE))
    success = found["next.success"].tolist()
    assert success == [False] * (math.ceil(result.succeeded_at * RATE - 1e-9) - 1) + [True]
    assert len(success) < RATE
    assert not found["next.truncated"].any()


def test_robot_has_what_was_applied_and_is_judged_by_nothing(tmp_path: Path) -> None:
    path = tmp_path / "robot.mcap"
    with Session("tandem", record=path) as session:
        client = session.client("/operator")
        client.publish("/io_teleop/joint_cmd", joint_state(["lift"], [0.2]))
        client.sleep(0.3)
    with pytest.raises(UsageError, match=r"^sentence: tandem has no task that says one; give the task in words$"):
        recorded_episode(path, 30)
    episode = recorded_episode(path, 30, sentence="Lift it.")
    found = values(episode)
    assert (episode.robot, episode.sentence, episode.is_success) == ("cellwright_tandem", "Lift it.", False)
    assert set(found) == {"observation.state", "action", "next.done", "next.truncated"}
    lift = episode.columns[0].names.index("lift")
    assert found["action"][-1, lift] == pytest.approx(0.2)
    assert found["observation.state"][0, lift] == pytest.approx(0.0, abs=1e-3)
    assert found["next.truncated"].tolist() == [False] * (len(found["action"]) - 1) + [True]


def test_unknown_camera_and_odd_rate_are_refused(path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean overhead"):
        recorded_episode(path, RATE, ["overhed"])
    with pytest.raises(UsageError, match=r"got 30 Hz\); take 25 or 50"):
        recorded_episode(path, 30)
