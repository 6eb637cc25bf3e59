"""Tests of the page of an evaluation on the command line: its start, and its end in every way."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from cellwright.cli.eval import watch
from tests.browser.serving import viewed
from tests.cli.conftest import CommandLine
from tests.running.evaluation.made_results import LOST, result
from tests.running.evaluation.programs import PROGRAMS, TRIAL
from tests.running.evaluation.results.test_follow import Folder
from tests.support.quick_children import QUICK_WORKERS
from tests.support.waiting import wait_until
from tests.viewer.web.fake_viewer import FakeViewer

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "tiny.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "programs.py").write_text(PROGRAMS, encoding="utf-8")
    return tmp_path


def evaluation(folder: Path, program: str, *more: str) -> Any:
    return viewed(folder, "eval", "tiny.yaml", "--agent", f"programs.py:{program}", "--jobs", "1", *more)


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize(("program", "status"), [("Deliver", 0), ("GiveUp", 1)])
def test_page_stays_after_the_evaluation_until_ctrl_c(folder: Path, program: str, status: int) -> None:
    with evaluation(folder, program) as process:
        url = process.url
        process.wait_for("^the page stays open until Ctrl-C$")
        assert (folder / "evaluation" / "report.html").exists()
        viewer = FakeViewer(url)
        wait_until(lambda: viewer.sees("bodies/world"), "scene of a late browser")
        assert process.interrupt() == status
        viewer.close()
        assert process.relatives() == []


@POSIX
@pytest.mark.slow
def test_page_ends_with_an_evaluation_that_is_interrupted(folder: Path) -> None:
    with evaluation(folder, "Hang") as process:
        viewer = FakeViewer(process.url)
        wait_until(lambda: viewer.sees("bodies/world"), "scene of the run in progress")
        assert process.interrupt() == 75
        viewer.close()
        assert "the page stays" not in process.said
        assert process.relatives() == []


@pytest.mark.slow
def test_page_ends_with_an_evaluation_for_programs(folder: Path) -> None:
    with evaluation(folder, "Deliver", "--json") as process:
        assert process.finish() == 0
        assert json.loads(process.out)["passed"] == 1
        assert "page: http://" in process.err
        assert process.relatives() == []


@POSIX
@pytest.mark.slow
def test_view_shows_shards_that_another_machine_fills(tmp_path: Path) -> None:
    runs = [result(), LOST]
    first, second = Folder(tmp_path / "1", runs), Folder(tmp_path / "2", runs)
    first.add(runs[0])
    with viewed(tmp_path, "view", "1", "2") as process:
        viewer = FakeViewer(process.url)
        second.add(LOST)
        wait_until(lambda: viewer.sees("bodies"), "page")
        viewer.close()
        assert process.interrupt() == 0
        assert process.relatives() == []


def test_view_of_a_folder_without_a_plan_or_of_another_is_refused(cellwright: CommandLine) -> None:
    Folder(Path("1"), [result()])
    Folder(Path("2"), [LOST])
    Path("3").mkdir()
    Path("3", "results.jsonl").touch()
    other = cellwright("view", "1", "2", "--view-port", "0")
    assert (other.status, other.out) == (2, "")
    assert other.err == "error: page cannot start: 2: does not belong to 1; give shards of one evaluation\n"
    none = cellwright("view", "3", "--view-port", "0")
    assert none.err == "error: page cannot start: 3: it has no plan.json; give the --out of `cellwright eval`\n"


def test_options_of_the_page_require_it(cellwright: CommandLine) -> None:
    ran = cellwright("eval", "lesson", "--view-port", "0")
    assert (ran.status, ran.err) == (2, "error: --view-port requires --view\n")
    assert not list(Path().iterdir())


class NoPage:
    """Stand-in for a page's process, which has ended."""

    is_running = False
    is_closed = False

    def close(self) -> None:
        self.is_closed = True


@QUICK_WORKERS
@pytest.mark.slow
def test_page_is_opened_with_plan_and_threshold_and_closed_after_bad_input(
    folder: Path, monkeypatch: pytest.MonkeyPatch, cellwright: CommandLine
) -> None:
    opened: list[Any] = []
    pages: list[NoPage] = []

    def open_page(*arguments: Any) -> NoPage:
        assert (arguments[0][0] / "plan.json").exists()
        opened.append(arguments[:2])
        pages.append(NoPage())
        return pages[-1]

    monkeypatch.setattr(watch, "open_evaluation_page", open_page)
    work = ("eval", "tiny.yaml", "--view", "--min-score", "50%")
    assert cellwright(*work, "--agent", "programs.py:CannotBeMade").status == 2
    assert cellwright(*work, "--agent", "programs.py:Deliver").status == 0
    assert opened == [([Path("evaluation")], "50%")] * 2
    assert [page.is_closed for page in pages] == [True, True]
