"""The example of the page on simulation interfaces puts a part onto a tray."""

from pathlib import Path

import pytest

from tests.docs.pages import blocks

PAGE = Path(__file__).parents[2] / "docs" / "simulation-interfaces.md"


def test_example_puts_part_onto_tray(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = (each.body for each in blocks(PAGE) if each.language == "python")
    exec(compile(example, str(PAGE), "exec"), {})
    assert capsys.readouterr().out == "['bin8|gear_part_1']\n"
