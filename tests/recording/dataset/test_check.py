"""Tests of the check: each damage to a good set is found, and named with its file. Also of its statistics."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cellwright.recording.dataset.check import check_lerobot
from cellwright.recording.dataset.layout import STATS
from tests.recording.dataset.sets import copied, write


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sets") / "good")


def test_good_set_has_no_problem(good: Path) -> None:
    assert check_lerobot(good) == []


def test_folder_that_is_no_set_is_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "meta/info.json"
    assert check_lerobot(tmp_path) == [f"{path}: cannot be read: No such file or directory"]


def test_missing_statistics_are_a_problem(good: Path, tmp_path: Path) -> None:
    folder = copied(good, tmp_path / "set")
    (folder / STATS).unlink()
    assert check_lerobot(folder) == [f"{folder / STATS}: cannot be read: No such file or directory"]


def without(feature: str, statistic: str | None = None) -> Callable[[Any], Any]:
    def change(found: Any) -> None:
        del (found[feature] if statistic else found)[statistic or feature]

    return change


def put(feature: str, statistic: str, value: Any) -> Callable[[Any], Any]:
    return lambda found: found[feature].update({statistic: value})


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (without("action"), "action: is missing"),
        (without("action", "count"), "action: count: is missing"),
        (without("observation.images.top", "q50"), "observation.images.top: q50: is missing"),
        (put("action", "q01", [0.0]), "action: q01: must have the shape (2,) (got (1,))"),
        (put("action", "q01", ["a", "b"]), "action: q01: must be a list of numbers"),
        (
            put("observation.images.top", "mean", [0.5, 0.5, 0.5]),
            "observation.images.top: mean: must have the shape (3, ",
        ),
        (put("frame_index", "max", [12]), "frame_index: max: must be 11 (got 12)"),
        (put("frame_index", "count", [20]), "frame_index: count: must be 21 (got 20)"),
    ],
    ids=["feature", "count", "quantile", "width", "text", "pictures", "maximum", "total"],
)
def test_wrong_statistics_are_a_problem(good: Path, tmp_path: Path, change: Callable[[Any], Any], text: str) -> None:
    folder = copied(good, tmp_path / "set")
    statistics = json.loads((folder / STATS).read_text())
    change(statistics)
    (folder / STATS).write_text(json.dumps(statistics))
    (problem,) = check_lerobot(folder)
    assert problem.startswith(f"{folder / STATS}: {text}")
