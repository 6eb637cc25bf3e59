"""Cost of viewing: its calculation, and one run as it is measured."""

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks import looking
from benchmarks.benchmarks import BenchmarkSkippedError

COSTS = {"--view": 0.1, "--record": 0.4, "--video": 1.2}
START = 0.8

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="requires /proc")


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float, str | None]]:
    """Runs with the durations below: 1 s bare, less in each repetition."""
    done: list[tuple[str, float, str | None]] = []

    def run(options: Sequence[str], until: float, browser: str | None) -> looking.FinishedRun:
        label = options[0] if options[0] in COSTS else ""
        done.append((label, until, browser))
        more = COSTS.get(label, 0.0)
        work = 0.0 if until == looking._SHORT else 1.0 + more
        size, seen = 2_000_000 if "--record" in options else 0, 9.0 if browser and label else 0.0
        return looking.FinishedRun(START + work + 0.5 / len(done), work, "same", size, seen)

    monkeypatch.setattr(looking, "_run", run)
    monkeypatch.setattr(looking, "_BROWSERS", ("sh",))
    return done


def test_viewing_cost_excludes_start_of_run(runs: list[tuple[str, float, str | None]]) -> None:
    progress: list[str] = []
    figures = {figure.label: figure for figure in looking.measure(progress.append, quick=False)}
    assert figures["a page without a browser / bare"].value == pytest.approx(1.1, abs=0.2)
    assert figures["a recording / bare"].value == pytest.approx(1.4, abs=0.2)
    assert "2.0 MB for 60 s" in figures["a recording / bare"].note
    assert figures["a video / bare"].value == pytest.approx(2.2, abs=0.2)
    assert figures["a picture of a video, in wall time"].value == pytest.approx(1200 / 201)
    assert figures["a video without a size / of 1280 x 720, in wall time"].value == pytest.approx(1.0)
    assert figures["different end states of the runs of the lesson"].value == 1
    assert {label: figure.maximum for label, figure in figures.items() if "page" in label} == {
        "a page without a browser / bare": looking.VIEW_COST,
        "a page in a browser, real time / bare": looking.SEEN_COST,
        "a page in a browser, full speed / bare": looking.SEEN_COST,
    }
    # the bare runs have a browser beside them, too
    assert [option for option, _until, browser in runs if browser][:2] == ["", "--view"]


def test_browser_figure_without_browser_is_nan(
    runs: list[tuple[str, float, str | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(looking, "_BROWSERS", ("no-such-browser",))
    figures = {figure.label: figure for figure in looking.measure(lambda _: None, quick=True)}
    assert math.isnan(figures["a page in a browser / bare"].value)
    assert figures["a page in a browser / bare"].is_held
    assert all(browser is None for _option, _until, browser in runs)


def test_browser_figure_without_connection_is_nan(
    runs: list[tuple[str, float, str | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = looking._run
    monkeypatch.setattr(looking, "_run", lambda options, until, _browser: ran(options, until, None))
    figures = {figure.label: figure for figure in looking.measure(lambda _: None, quick=True)}
    for pace in ("real time", "full speed"):
        figure = figures[f"a page in a browser, {pace} / bare"]
        assert math.isnan(figure.value)
        assert "did not connect" in figure.note
    assert runs


@pytest.mark.slow
def test_finished_run_reports_time_hash_and_file_size(tmp_path: Path) -> None:
    ran = looking._run(["--record", str(tmp_path / "run.mcap"), "lesson"], 0.1, None)
    assert ran.processor > 0.05
    assert 0 < ran.wall < 60
    assert len(ran.state_hash) == 64
    assert ran.file_size == (tmp_path / "run.mcap").stat().st_size > 1000


def test_viewing_cost_without_proc_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "exists", lambda _self: False)
    with pytest.raises(BenchmarkSkippedError, match="/proc"):
        next(looking.measure(lambda _: None, quick=True))
