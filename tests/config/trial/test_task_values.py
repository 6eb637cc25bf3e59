"""Readers of single values of a task."""

import pytest

from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.task import KitBuilt, Scored
from cellwright.util.errors import DescriptionError
from tests.cell.tasks.cells import BASE, trial


@pytest.mark.parametrize("sentence", ["''", "5", "[a]", "'a\\tb'", f"{'long ' * 101}"])
def test_sentence_is_a_printable_text(sentence: str) -> None:
    text = f"{BASE}task:\n  sentence: {sentence}\n  success: {{kit: full}}\n".replace("'a\\tb'", '"a\\tb"')
    with pytest.raises(DescriptionError, match=r"task\.sentence: must be a sentence of 1 to 500 printable characters"):
        load_trial(text=text)


@pytest.mark.parametrize(("points", "found"), [("full", None), ("2", 2.0), ("0.5", 0.5)])
def test_points_are_numbers_or_all(points: str, found: float | None) -> None:
    task = trial(f"{{kit: {points}, score: {points}}}").task
    assert task is not None
    assert task.success == (KitBuilt(found), Scored(found))


@pytest.mark.parametrize("points", ["0", "-1", "true", ".inf", ".nan", "[1]", "'2'", ""])
def test_other_points_are_refused(points: str) -> None:
    with pytest.raises(DescriptionError, match=r"task\.success\.kit: must be full or points above 0"):
        trial(f"{{kit: {points}}}")
