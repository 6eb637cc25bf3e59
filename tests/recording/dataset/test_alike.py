"""Tests of the requirements on the episodes of one data set."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cellwright.recording.dataset.alike import require_alike, require_valid
from cellwright.recording.dataset.episode import Column
from cellwright.util.errors import UsageError
from tests.recording.dataset.sets import made

FIRST = made(0)
STATE = FIRST.columns[0]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"rate": 10}, "rate: other than in run0.mcap, 20 Hz (got 10 Hz)"),
        ({"films": ()}, "cameras: other than in run0.mcap, top (got none)"),
        ({"columns": FIRST.columns[:1]}, "columns: other than in run0.mcap, observation.state, action"),
        (
            {"columns": (replace(STATE, names=("a", "b", "d")), *FIRST.columns[1:])},
            "column observation.state: other than in run0.mcap, float32 a, b, c (got float32 a, b, d)",
        ),
    ],
    ids=["rate", "cameras", "columns", "names"],
)
def test_episode_of_another_form_is_refused(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(UsageError) as caught:
        require_alike(made(1, **changes), FIRST)
    assert str(caught.value).startswith(f"run1.mcap: {text}")
    assert str(caught.value).endswith("put it into a data set of its own")


def test_episode_of_the_same_form_is_accepted() -> None:
    require_alike(made(1), FIRST)


@pytest.mark.parametrize(
    ("column", "text"),
    [
        (Column("a/b", np.zeros(12, np.float32), ()), "a/b: a name in a data set has no slash; name it otherwise"),
        (Column("index", np.zeros(12, np.float32), ()), "index: the data set has a column of this name"),
        (Column("action", np.zeros(12, np.float32), ()), "action: the data set has a column of this name"),
        (Column("a", np.zeros(11, np.float32), ()), "a: all columns have the same number of frames (got 11, not 12)"),
        (Column("a", np.zeros(12), ()), "a: values are of float32 or bool (got float64)"),
        (Column("a", np.zeros((12, 2), np.float32), ("x",)), "a: one name for each value of a row, and none for a"),
        (Column("a", np.full(12, np.nan, np.float32), ()), "a: values are finite (got nan)"),
    ],
    ids=["slash", "own", "twice", "length", "type", "names", "nan"],
)
def test_column_that_no_set_takes_is_refused(column: Column, text: str) -> None:
    with pytest.raises(UsageError) as caught:
        require_valid(made(0, columns=(*FIRST.columns, column)))
    assert str(caught.value).startswith(f"run0.mcap: {text}")


def test_episode_without_its_task_in_words_is_refused() -> None:
    with pytest.raises(UsageError, match=r"^run0\.mcap: sentence: is empty; give the task in words$"):
        require_valid(made(sentence=""))


@pytest.mark.parametrize("columns", [(), (Column("a", np.zeros(0, np.float32), ()),)], ids=["none", "empty"])
def test_episode_without_frames_is_refused(columns: tuple[Column, ...]) -> None:
    with pytest.raises(UsageError, match=r"run0.mcap: has no frame; leave it out"):
        require_valid(made(0, columns=columns))
