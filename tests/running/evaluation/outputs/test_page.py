"""Tests of the content of an evaluation's page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.rendering.scene.scene import decode_frame, decode_scene
from cellwright.running.evaluation.outputs import page as pages
from cellwright.running.evaluation.outputs.page import EvaluationSource
from cellwright.running.evaluation.results.follow import FollowedEvaluation
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.state import LIVE_NAME, StateReporter, state_file, write_state
from cellwright.running.evaluation.results.summary import Threshold, summarize
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.viewer.services.names import FRAME, PANEL, SCENE
from cellwright.viewer.web.evaluation_panels import SHOW, EvaluationPanel
from tests.running.evaluation.made_results import CRASHED, LOST, SCORE, result, worked
from tests.running.evaluation.results.test_follow import Folder
from tests.running.evaluation.results.test_state import Sent
from tests.support.cells import KITTING

RUNS = [result(), CRASHED, LOST, worked(seed=4), result(trial="other")]


class Watched:
    """Page of an evaluation whose time passes with each look.

    Args:
        path: folder of the evaluation.
        runs: its planned runs.
    """

    def __init__(self, path: Path, runs: list[Result], threshold: str = "") -> None:
        self.folder, self.now = Folder(path, runs), 0.0
        evaluation = FollowedEvaluation([path], clock=lambda: self.now)
        self.source = EvaluationSource(
            evaluation, Threshold.read(threshold) if threshold else None, clock=lambda: self.now
        )
        self._cell, self._sent = Cell(KITTING), Sent()
        self._reporter = StateReporter(self._cell, self._sent)

    def panel(self) -> EvaluationPanel:
        self.now += 100.0
        panel = self.source.ask(PANEL)["of"]
        assert isinstance(panel, EvaluationPanel)
        return panel

    def state(self, each: Result | None, name: str = "") -> int:
        """Write the state of a run, or that of one in progress; return its time [ns]."""
        self._cell.simulation.step()
        self._reporter.report()
        log = "" if each is None else each.log_name
        states = self.folder.path / "states"
        file = states / LIVE_NAME if each is None else state_file(self.folder.path, log)
        write_state(file, name, self._sent.scene, self._sent.frames[-1])
        return self._cell.simulation.now

    def frame(self) -> dict[str, Any]:
        answer, data = self.source.ask_data(FRAME)
        return {**answer, "time": decode_frame(data).time}

    def select(self, key: str) -> None:
        self.source.ask(SHOW, key=key)


def test_figures_are_those_of_the_report(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS, "75%")
    assert (watched.panel().done, watched.panel().share, watched.panel().pace) == (0, None, "5 to go")
    watched.folder.add(*RUNS)
    panel = watched.panel()
    assert (panel.agent, panel.done, panel.runs, panel.failed) == ("my.py:Mine", 5, 5, 2)
    assert (panel.passed, panel.requirement) == (2, "done, with at least 75 % of the points")
    assert panel.pace == "all runs have a result"
    for row, summary in zip(panel.trials, summarize(RUNS), strict=True):
        assert (row.name, row.done, row.mean) == (summary.trial, summary.runs, summary.mean)
        assert row.interval == pytest.approx(summary.mean_interval)


def test_failures_are_listed_worst_first_and_the_newest_is_shown(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS)
    watched.folder.add(CRASHED)
    assert watched.panel().detail is not None
    watched.folder.add(RUNS[0], LOST, RUNS[3], RUNS[4])
    panel = watched.panel()
    assert panel.failures == [
        ("tiny-3", "tiny seed 3: 0 of 12, wall limit"),
        ("tiny-2", "tiny seed 2: 2 of 12, crashed"),
        ("tiny-4", "tiny seed 4: 2 of 12, done"),
    ]
    assert panel.detail is not None
    assert panel.detail.name == "tiny seed 4"
    watched.select("tiny-2")
    detail = watched.panel().detail
    assert detail is not None
    assert (detail.outcome, detail.is_done, detail.points) == ("crashed", False, "2 of 12 points")
    assert detail.log == ["Traceback", r"ValueError: <no> & \x07 \x1b[31m"]
    assert [kit.title for kit in detail.kits] == [
        "order_0_kit_0: 2 of 6 points",
        "order_0_kit_1: 0 of 4 points attainable, 6 at most",
    ]
    assert detail.kits[0].parts[1].sentence == SCORE["orders"][0]["kits"][0]["parts"][1]["sentence"]  # type: ignore[index]
    assert detail.kits[0].extras == ["bin2|disk_part_1: wrong type"]
    watched.select("")
    assert watched.panel().selected == ""


def test_equal_labels_differ_by_their_keys_and_the_list_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "MAX_FAILURES", 2)
    runs = [result(1.0, key=f"{number}" * 24) for number in range(3)]
    watched = Watched(tmp_path, runs)
    watched.folder.add(*runs)
    panel = watched.panel()
    assert [label for _, label in panel.failures] == [
        "tiny seed 1: 1 of 12, done",
        "tiny seed 1: 1 of 12, done (11111111)",
    ]
    assert panel.more_failures == 1


def test_selection_that_is_gone_is_refused_and_given_up(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS)
    watched.folder.add(CRASHED)
    watched.panel()
    with pytest.raises(RejectedCommandError, match="no such run"):
        watched.select("tiny-9")
    watched.select("tiny-2")
    watched.folder.file.write_bytes(b"")
    panel = watched.panel()
    assert (panel.selected, panel.detail) == ("", None)


def test_last_state_of_the_shown_failure_is_in_the_scene(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS)
    assert decode_scene(bytes(watched.source.ask_data(SCENE)[1])).bodies == ("world",)
    first = watched.frame()
    times = {each.key: watched.state(each) for each in (CRASHED, LOST)}
    watched.folder.add(CRASHED)
    assert watched.panel().picture == "tiny seed 2 at its end, 0.0 s"
    shown = watched.frame()
    assert (shown["time"], shown["digest"] != first["digest"]) == (times["tiny-2"], True)
    assert "agv1::kit_tray_1::kit_tray_1::tray" in decode_scene(bytes(watched.source.ask_data(SCENE)[1])).bodies
    watched.folder.add(LOST)
    watched.panel()
    newer = watched.frame()
    assert (newer["time"], newer["digest"]) == (times["tiny-3"], shown["digest"])
    assert newer["run"] != shown["run"]  # no body glides from one run to the other
    watched.select("tiny-2")
    assert watched.frame()["time"] == times["tiny-2"]


def test_run_without_a_state_says_so(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS)
    watched.folder.add(CRASHED)
    assert watched.panel().picture == "tiny seed 2: its last state is not known"


def test_run_in_progress_is_shown_until_one_fails(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS)
    assert watched.panel().picture == "no run has begun yet"
    watched.state(None, "tiny seed 1")
    watched.folder.add(RUNS[0])
    assert watched.panel().picture == "tiny seed 1, 0.0 s"
    before = watched.frame()
    time = watched.state(None, "tiny seed 1")
    watched.panel()
    after = watched.frame()
    assert (after["time"], after["run"]) == (time, before["run"])
    (tmp_path / "states" / LIVE_NAME).write_bytes(b"")
    assert watched.panel().picture == "tiny seed 1, 0.0 s"
    watched.folder.add(LOST)
    assert watched.panel().picture == "tiny seed 3: its last state is not known"


def test_evaluation_without_losses_and_live_state_says_so(tmp_path: Path) -> None:
    watched = Watched(tmp_path, RUNS[:1])
    watched.folder.add(RUNS[0])
    assert watched.panel().picture == "no run has lost points"


def test_points_that_no_run_has_are_a_notice(tmp_path: Path) -> None:
    strange = [result(each, seed=seed, reachable=1e-300) for seed, each in enumerate((1e308, -1e308, 0.0))]
    watched = Watched(tmp_path, strange)
    watched.folder.add(*strange)
    for notice in watched.panel().notices:
        assert ": points must " in notice


def test_requests_that_no_evaluation_has_are_refused(tmp_path: Path) -> None:
    source = Watched(tmp_path, RUNS).source
    with pytest.raises(UnknownNameError):
        source.ask("cellwright/control", action="pause")
    for refused in (lambda: source.publish("/x", None), lambda: source.call("/x", None)):
        with pytest.raises(RejectedCommandError):
            refused()
    assert source.sibling() is source
    source.close()


def test_growing_evaluation_costs_no_new_figures_at_each_look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [result(seed=seed) for seed in range(1, 101)]
    watched = Watched(tmp_path, runs)
    counts: list[int] = []
    compute = EvaluationSource._compute

    def counted(source: EvaluationSource) -> None:
        counts.append(1)
        compute(source)

    monkeypatch.setattr(EvaluationSource, "_compute", counted)
    for each in runs:
        watched.folder.add(each)
        watched.now += 0.05
        watched.source.ask(PANEL)
    assert 5 <= len(counts) <= 12  # ten looks in five seconds
    assert json.loads(watched.folder.file.read_text().splitlines()[-1])["seed"] == 100
