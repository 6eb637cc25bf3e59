"""Examples in the page on configuration are valid and as the page describes them."""

import re
from pathlib import Path

import pytest

from cellwright.config.trial.gear2017 import load_trial

PAGE = (Path(__file__).parents[3] / "docs" / "configuration.md").read_text()
EXAMPLES = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES)
def test_page_examples_load_without_warnings(example: str) -> None:
    assert load_trial(text=example).warnings == ()


def test_page_has_eight_examples() -> None:
    assert len(EXAMPLES) == 8
