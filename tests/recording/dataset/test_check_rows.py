"""Tests of the check of tables: order, types, places and sentences, also those that LeRobot reads without a word."""

import json
from pathlib import Path

import numpy as np
import pytest

from cellwright.recording.dataset.check import check_lerobot
from cellwright.recording.dataset.check_rows import check_rows
from cellwright.recording.dataset.described import read_description
from cellwright.recording.dataset.layout import INFO, TASKS
from tests.recording.dataset.damage import (
    Change,
    as_lists,
    put,
    replaced,
    reversed_rows,
    swapped,
    with_another,
    without,
)
from tests.recording.dataset.sets import DATA, EPISODES, change_info, change_table, copied, write


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sets") / "good")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (reversed_rows, "episode_index must rise by one from 0 (got 1 in row 0 of the set)"),
        (swapped, "index must be 3 in row 3 of the set (got 4)"),
        (put("index", lambda values: [each + 1 for each in values]), "index must be 0 in row 0 of the set (got 1)"),
        (put("frame_index", replaced(13, 13)), "frame_index must be 1 in row 13 of the set (got 13)"),
        (put("timestamp", replaced(13, 0.1)), "timestamp must be 0.05 in row 13 of the set (got 0.1"),
        (put("timestamp", lambda values: [2 * each for each in values]), "timestamp must be 0.05 in row 1 of the set"),
        (put("task_index", replaced(20, 2)), "task_index must be below 2 (got 2)"),
        (put("episode_index", replaced(12, 2)), "episode_index must rise by one from 0 (got 2 in row 12 of the set)"),
        (put("next.reward", replaced(5, np.nan)), "next.reward: must be finite (got nan in row 5 of the set)"),
        (put("action", replaced(5, [0.0, np.inf])), "action: must be finite (got [ 0. inf] in row 5 of the set)"),
        (put("next.reward", replaced(5, None)), "next.reward: has no value in 1 rows"),
        (without("timestamp"), "timestamp: column is missing"),
        (without("action"), "action: column is missing"),
        (with_another, "extra: no feature of info.json"),
        (as_lists, "next.reward: must be a column of float (got fixed_size_list<"),
    ],
    ids=lambda value: "" if callable(value) else value.split(" (")[0].replace(" ", "-")[:40],
)
def test_wrong_frames_are_a_problem(good: Path, tmp_path: Path, change: Change, text: str) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / DATA, change)
    assert check_lerobot(folder)[0].startswith(f"{folder / DATA}: {text}")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (reversed_rows, "episode 0: episode_index must be the number of its row (got 1)"),
        (put("length", replaced(1, 8)), "episode 1: length must be 9 (got 8)"),
        (put("dataset_from_index", replaced(1, 0)), "episode 1: dataset_from_index must be 12 (got 0)"),
        (put("data/file_index", replaced(1, 1)), "episode 1: its frames must be in "),
        (
            put("tasks", lambda values: values[::-1]),
            "episode 0: tasks must be ['Pick the gear.'] (got ['Place the part.'])",
        ),
        (put("length", replaced(1, None)), "length: must be a number of at least 0 (got None)"),
        (
            put("videos/observation.images.top/to_timestamp", replaced(0, np.nan)),
            "videos/observation.images.top/to_time",
        ),
        (
            without("videos/observation.images.top/from_timestamp"),
            "videos/observation.images.top/from_timestamp: column",
        ),
    ],
    ids=["order", "length", "from", "file", "sentence", "none", "nan", "column"],
)
def test_wrong_episodes_are_a_problem(good: Path, tmp_path: Path, change: Change, text: str) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / EPISODES, change)
    assert check_lerobot(folder)[0].startswith(f"{folder / EPISODES}: {text}")


def test_episodes_without_their_sentences_are_accepted(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / EPISODES, without("tasks"))
    assert check_lerobot(folder) == []


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (reversed_rows, "task_index must be the number of its row (got [1, 0])"),
        (lambda table: table.replace_schema_metadata(None), "pandas metadata must name task as the index (got None)"),
        (lambda table: table.slice(0, 1), "must have the total_tasks of info.json, 2 (got 1)"),
        (put("task", lambda values: [values[0]] * 2), "a task stands in one row alone (got 1 again)"),
        (without("task"), "columns must be task and task_index (got task_index)"),
    ],
    ids=["order", "pandas", "missing", "twice", "column"],
)
def test_wrong_tasks_are_a_problem(good: Path, tmp_path: Path, change: Change, text: str) -> None:
    folder = copied(good, tmp_path / "set")
    change_table(folder / TASKS, change)
    assert check_lerobot(folder)[0].startswith(f"{folder / TASKS}: {text}")


@pytest.mark.parametrize(
    ("name", "text"),
    [("total_frames", "data: must have total_frames"), ("total_episodes", "meta/episodes: must have as many episodes")],
)
def test_wrong_total_is_a_problem(good: Path, tmp_path: Path, name: str, text: str) -> None:
    folder = copied(good, tmp_path / "set")
    change_info(folder, **{name: 1})
    assert check_lerobot(folder)[0].startswith(f"{folder}/{text}")


def test_feature_of_another_shape_is_a_problem(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    features = json.loads((folder / INFO).read_text())["features"]
    features["action"] |= {"shape": [3], "names": ["x", "y", "z"]}
    change_info(folder, features=features)
    assert check_lerobot(folder)[0].startswith(f"{folder / DATA}: action: must be a column of fixed_size_list<")


@pytest.mark.parametrize("name", [DATA, EPISODES, TASKS])
def test_table_that_cannot_be_read_is_a_problem(good: Path, tmp_path: Path, name: str) -> None:
    folder = copied(good, tmp_path / "set")
    (folder / name).write_bytes(b"PAR1 no table")
    assert check_lerobot(folder)[0].startswith(f"{folder / name}: cannot be read: ")
    (folder / name).unlink()
    assert check_lerobot(folder)


def test_contents_of_good_tables_are_read(good: Path) -> None:
    problems: list[str] = []
    described = read_description(good, problems)
    assert described is not None
    rows = check_rows(described, problems)
    assert problems == []
    assert rows.starts == [0, 12, 21]
    assert rows.columns["action"].shape == (21, 2)
    assert [row["length"] for row in rows.episodes] == [12, 9]
