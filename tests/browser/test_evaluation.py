"""Page of an evaluation in a browser: its progress, a program that fails, its last words and its last state."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Visit
from tests.browser.serving import viewed

pytestmark = pytest.mark.browser

PROGRAM = """
import time
from pathlib import Path


class Robot:
    def run(self, client):
        client.start_competition()
        client.sleep(2.5)
        while not Path("go").exists():
            time.sleep(0.01)
        client.sleep(0.5)
        print("<b>last</b> words of seed")
        raise LookupError("the gear <i>is</i> gone")
"""


def test_page_shows_progress_and_failures_of_an_evaluation(tmp_path: Path, visit: Visit) -> None:
    (tmp_path / "robot.py").write_text(PROGRAM, encoding="utf-8")
    work = ("eval", "lesson", "--agent", "robot.py:Robot", "--seeds", "2", "--jobs", "1")
    with viewed(tmp_path, *work) as process:
        visitor = visit(process.url)
        visitor.read("of 2 runs")
        visitor.read(r"view: lesson seed 1, 2\.5 s")
        before = visitor.scene()
        assert "no result" in visitor.text()
        visitor.page.get_by_role("tab", name="Failures").click()
        visitor.read("no run has lost points")
        (tmp_path / "go").touch()
        visitor.read("all runs have a result")
        visitor.read(r"view: lesson seed 2 at its end, 3\.0 s")
        text = visitor.read("(?s)lesson seed 2\ncrashed\n.*Last words.*Last events.*Repeat this run.*").group()
        assert "LookupError: the gear <i>is</i> gone" in text
        assert "<b>last</b> words of seed" in text
        assert "cellwright run lesson --agent robot.py:Robot --seed 2" in text
        visitor.page.locator("input[role=combobox]:visible").click()
        visitor.page.get_by_role("option", name="lesson seed 1: 0 of 8, crashed").click()
        visitor.read(r"view: lesson seed 1 at its end, 3\.0 s")
        visitor.read("lesson seed 1\ncrashed")
        assert visitor.scene().shape == before.shape
        late = visit(process.url)
        late.read(r"view: lesson seed 1 at its end, 3\.0 s")
        late.scene()
        process.wait_for("^the page stays open until Ctrl-C$")
        assert process.interrupt() == 1
        assert process.relatives() == []
        assert (tmp_path / "evaluation" / "report.html").stat().st_size > 100_000  # with its pictures
