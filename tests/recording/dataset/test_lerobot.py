"""Tests of the writer of LeRobotDataset v3.0."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

from cellwright.recording.dataset.check import check_lerobot
from cellwright.recording.dataset.layout import INFO, STATS, TASKS
from cellwright.recording.dataset.lerobot import write_lerobot
from cellwright.util.errors import UsageError
from tests.recording.dataset.sets import (
    CAMERAS,
    DATA,
    EPISODES,
    HEIGHT,
    LENGTHS,
    SENTENCES,
    WIDTH,
    grey,
    greys,
    made,
    write,
)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sets") / "good", CAMERAS)


def test_set_has_the_files_of_the_format(good: Path) -> None:
    found = sorted(path.relative_to(good).as_posix() for path in good.rglob("*") if path.is_file())
    videos = [f"videos/observation.images.{camera}/chunk-000/file-000.mp4" for camera in sorted(CAMERAS)]
    assert found == ["README.md", DATA, EPISODES, INFO, STATS, TASKS, *videos]
    assert check_lerobot(good) == []


def test_description_counts_and_names_what_is_there(good: Path) -> None:
    info = json.loads((good / INFO).read_text())
    expected = {"codebase_version": "v3.0", "fps": 20, "robot_type": "cellwright_ur10", "total_episodes": 2}
    expected |= {"total_frames": 21, "total_tasks": 2, "splits": {"train": "0:2"}}
    assert {name: info[name] for name in expected} == expected
    features = info["features"]
    assert features["action"] == {"dtype": "float32", "shape": [2], "names": ["x", "y"]}
    assert features["next.done"] == {"dtype": "bool", "shape": [1], "names": None}
    assert features["index"] == {"dtype": "int64", "shape": [1], "names": None}
    video = features["observation.images.top"]
    assert (video["dtype"], video["shape"]) == ("video", [HEIGHT, WIDTH, 3])
    assert video["info"]["video.codec"] == "av1"


def test_rows_have_their_numbers_times_and_values(good: Path) -> None:
    rows = parquet.read_table(good / DATA).to_pydict()
    assert rows["index"] == [*range(21)]
    assert rows["frame_index"] == [*range(12), *range(9)]
    assert rows["episode_index"] == rows["task_index"] == [0] * 12 + [1] * 9
    np.testing.assert_array_equal(rows["timestamp"], np.float32(np.array(rows["frame_index"]) / 20))
    for number, start in ((0, 0), (1, 12)):
        for column in made(number).columns:
            np.testing.assert_array_equal(rows[column.name][start : start + LENGTHS[number]], column.values)


def test_tasks_are_the_index_of_a_pandas_table(good: Path) -> None:
    table = parquet.read_table(good / TASKS)
    assert table.to_pydict() == {"task_index": [0, 1], "task": [*SENTENCES]}
    assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == ["task"]


def test_episodes_say_where_their_frames_are(good: Path) -> None:
    rows = parquet.read_table(good / EPISODES).to_pylist()
    assert [row["tasks"] for row in rows] == [[each] for each in SENTENCES]
    assert [(row["dataset_from_index"], row["dataset_to_index"], row["length"]) for row in rows] == [
        (0, 12, 12),
        (12, 21, 9),
    ]
    assert [(row["recording/name"], row["recording/sha256"]) for row in rows] == [
        ("run0.mcap", "0" * 64),
        ("run1.mcap", "1" * 64),
    ]
    times = [tuple(row[f"videos/observation.images.side/{side}_timestamp"] for side in ("from", "to")) for row in rows]
    assert times == [(0.0, 0.6), (0.6, 1.05)]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("episode", [0, 1])
def test_picture_at_the_time_of_a_frame_is_that_of_the_frame(good: Path, camera: str, episode: int) -> None:
    expected = [grey(episode, frame, camera) for frame in range(LENGTHS[episode])]
    np.testing.assert_allclose(greys(good, episode, camera), expected, atol=3)


def test_statistics_are_those_of_all_frames(good: Path) -> None:
    statistics = json.loads((good / STATS).read_text())
    action = np.concatenate([made(number).columns[1].values for number in (0, 1)]).astype(np.float64)
    np.testing.assert_allclose(statistics["action"]["q10"], np.quantile(action, 0.1, axis=0), rtol=1e-12)
    levels = np.array([grey(number, frame) for number in (0, 1) for frame in range(LENGTHS[number])]) / 255
    picture = statistics["observation.images.top"]
    np.testing.assert_allclose(picture["mean"], np.full((3, 1, 1), levels.mean()), rtol=1e-12)
    assert picture["count"] == [21]


def test_equal_episodes_give_equal_bytes(good: Path, tmp_path: Path) -> None:
    again = write(tmp_path / "again", CAMERAS)
    for path in good.rglob("*"):
        if path.is_file():
            assert (again / path.relative_to(good)).read_bytes() == path.read_bytes(), path


def test_set_without_cameras_has_no_videos(tmp_path: Path) -> None:
    write_lerobot(tmp_path / "numbers", [made(0, ())])
    assert not (tmp_path / "numbers/videos").exists()
    assert json.loads((tmp_path / "numbers" / INFO).read_text())["video_path"] is None
    assert check_lerobot(tmp_path / "numbers") == []


def test_progress_counts_episodes_and_frames(tmp_path: Path) -> None:
    seen: list[Any] = []
    write_lerobot(tmp_path / "set", [made(0, ()), made(1, ())], lambda *counts: seen.append(counts))
    assert seen == [(1, 12), (2, 21)]


def test_set_may_grow_in_another_folder(tmp_path: Path) -> None:
    seen: list[Any] = []
    write_lerobot(
        tmp_path / "set", [made(0, ())], lambda *_: seen.extend((tmp_path / "new").iterdir()), beside=tmp_path / "new"
    )
    assert [(path.name[:5], path.exists()) for path in seen] == [(".set-", False)]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["new", "set"]


def test_folder_that_exists_is_refused_and_kept(tmp_path: Path) -> None:
    (tmp_path / "set").mkdir()
    with pytest.raises(UsageError, match=r"set: exists already; name another folder, or remove this one"):
        write_lerobot(tmp_path / "set", [made()])
    assert [*(tmp_path / "set").iterdir()] == []


def test_set_without_episodes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no episode to write"):
        write_lerobot(tmp_path / "set", [])
    assert [*tmp_path.iterdir()] == []


def sized(width: int, height: int = HEIGHT) -> Any:
    return lambda _frame, _camera: np.zeros((height, width, 3), np.uint8)


@pytest.mark.parametrize(
    ("second", "text"),
    [
        (made(1, robot="other"), "run1.mcap: robot: other than in run0.mcap, cellwright_ur10 (got other)"),
        (made(1, picture=sized(98)), "run1.mcap: camera top: other than in run0.mcap, 96 x 64 pixels (got 98 x 64"),
        (made(1, filmed=8), "run1.mcap: camera top: one picture per frame (got 8 for 9)"),
    ],
    ids=["robot", "size", "pictures"],
)
def test_episode_that_cannot_stand_beside_the_first_leaves_nothing(second: Any, text: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        write_lerobot(tmp_path / "set", [made(0), second])
    assert str(caught.value).startswith(text)
    assert [*tmp_path.iterdir()] == []
