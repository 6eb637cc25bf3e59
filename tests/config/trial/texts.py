"""Trials as texts, and the lines that reading them gives."""

import pytest

from cellwright.config.trial.gear2017 import Loaded, load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError

GRID = "{xyz_start: [0.1, 0.1, 0.0], xyz_end: [0.5, 0.5, 0.0], rpy: [0, 0, pi/4], num_models_x: 2, num_models_y: 2}"
INSERT = "options: {insert_models_over_bins: true}\n"
ORDER = "announcement_condition: time, announcement_condition_value: 0.0"
PART = "{type: gear_part, pose: {}}"


def load(text: str) -> Loaded:
    return load_trial(text=text)


def trial(text: str) -> Trial:
    return load(text).trial


def warnings(text: str) -> list[str]:
    return [str(problem).removeprefix("<text>:") for problem in load(text).warnings]


def errors(text: str) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load(text)
    return [str(problem).removeprefix("<text>:") for problem in caught.value.problems]


def error(text: str) -> str:
    found = errors(text)
    assert len(found) == 1, found
    return found[0]


def warning(text: str) -> str:
    found = warnings(text)
    assert len(found) == 1, found
    return found[0]


def conditional(condition: str, value: object) -> str:
    terms = f"announcement_condition: {condition}, announcement_condition_value: {value}"
    return f"orders: {{o: {{{terms}, parts: {{a: {PART}}}}}}}"
