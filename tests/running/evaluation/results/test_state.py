"""Tests of last states: what is kept of which run, of killed ones too, and what a reader refuses."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.rendering.scene.scene import decode_frame, encode_scene
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import RunLimits
from cellwright.running.evaluation.results.folder import plan_of, plan_text
from cellwright.running.evaluation.results.merge import merge
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.evaluation.results.state import (
    LIVE_NAME,
    StateError,
    StateReporter,
    read_state,
    scene_file_of,
    state_file,
    write_state,
)
from tests.running.evaluation.conftest import Judge, tiny_jobs
from tests.support.cells import KITTING
from tests.support.quick_children import QUICK_WORKERS
from tests.support.waiting import wait_until


class Sent:
    """Messages of a reporter."""

    def __init__(self) -> None:
        self.scene = ""
        self.frames: list[str] = []

    def __call__(self, kind: str, content: object) -> None:
        if kind == "scene":
            self.scene = str(content)
        else:
            self.frames.append(str(content))


def time_of(frame: str) -> int:
    return decode_frame(base64.b64decode(frame)).time


def file_of(result: Result, folder: Path) -> Path:
    return state_file(folder, result.log_name)


def test_state_is_read_as_written(tmp_path: Path) -> None:
    cell, sent, file = Cell(KITTING), Sent(), tmp_path / "states" / "one.state"
    reporter = StateReporter(cell, sent)
    for _ in range(100):
        cell.simulation.step()
    reporter.report()
    write_state(file, "tiny seed 1\n<b>", sent.scene, sent.frames[-1])
    state = read_state(file)
    assert (state.name, state.frame.time) == ("tiny seed 1 <b>", cell.simulation.now)
    assert encode_scene(state.scene) == base64.b64decode(sent.scene)
    assert scene_file_of(file).read_bytes() == base64.b64decode(sent.scene)


def test_reporter_leaves_run_unchanged() -> None:
    watched, alone = Cell(KITTING), Cell(KITTING)
    reporter = StateReporter(watched, Sent())
    for number in range(50):
        watched.simulation.step()
        alone.simulation.step()
        if number % 7 == 0:
            reporter.report()
    assert watched.state_hash() == alone.state_hash()


def test_reporter_sends_state_of_program_that_hangs() -> None:
    cell, sent = Cell(KITTING), Sent()
    StateReporter(cell, sent)
    cell.simulation.step()  # and nothing more is reported
    wait_until(lambda: time_of(sent.frames[-1]) == cell.simulation.now, "state of the standing cell")


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(("program", "limits"), [("Crash", {}), ("GiveUp", {}), ("Hang", {"wall": 4.0}), ("Quit", {})])
def test_run_that_is_not_done_has_a_state(judge: Judge, folder: Path, program: str, limits: dict[str, float]) -> None:
    (result,) = judge(program, **limits)
    assert not result.is_done
    state = read_state(file_of(result, folder / "out"))
    assert state.name == "tiny seed 1"
    if program in ("Crash", "Hang"):
        assert state.frame.time == 100_000_000
    assert "agv1::kit_tray_1::kit_tray_1::tray" in state.scene.bodies


@QUICK_WORKERS
@pytest.mark.slow
def test_run_with_all_points_has_no_state_but_a_live_one(judge: Judge, folder: Path) -> None:
    (result,) = judge("Deliver")
    assert result.share == 1.0
    assert {each.name for each in (folder / "out" / "states").glob("*.state")} <= {LIVE_NAME}


@QUICK_WORKERS
@pytest.mark.slow
def test_state_that_cannot_be_written_is_reported_and_result_counts(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "states").write_text("in the way", encoding="utf-8")
    faults: list[str] = []
    with ResultsFile(folder / "out") as store:
        (job,) = tiny_jobs(folder, "GiveUp")
        assert LocalRunner(store, RunnerOptions(on_fault=faults.append)).run([job])
        assert store.results[job.key].outcome == "gave_up"
    assert faults == ["tiny seed 1: its last state cannot be written: File exists"]


@QUICK_WORKERS
@pytest.mark.slow
def test_merge_copies_states_with_their_scenes(judge: Judge, folder: Path) -> None:
    (result,) = judge("GiveUp")
    plan = plan_of(tiny_jobs(folder, "GiveUp"), RunLimits())
    (folder / "out" / "plan.json").write_text(plan_text(plan), encoding="utf-8")
    merge([folder / "out"], folder / "merged")
    own, copy = file_of(result, folder / "out"), file_of(result, folder / "merged")
    assert copy.read_bytes() == own.read_bytes()
    assert read_state(copy).name == "tiny seed 1"
    assert not copy.with_name(LIVE_NAME).exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not enough values"),
        (b"../../../etc/passwd\nname\nx", "no digest"),
        (b"0123456789abcdef\nname\n", "its last state is not known"),  # there is no such scene
        (b"0123456789abcdeg\nname\n", "no digest"),
        (b"\xff\xfe\nname\n", "no digest"),
    ],
)
def test_file_that_is_no_state_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    file = tmp_path / "a.state"
    file.write_bytes(content)
    with pytest.raises(StateError, match=message):
        read_state(file)


def test_state_of_another_scene_or_a_damaged_one_is_refused(tmp_path: Path) -> None:
    cell, sent, file = Cell(KITTING), Sent(), tmp_path / "states" / "one.state"
    StateReporter(cell, sent)
    write_state(file, "one", sent.scene, sent.frames[0])
    whole = file.read_bytes()
    for damaged in (whole[:-1], whole[:40] + b"\xff" * (len(whole) - 40)):
        file.write_bytes(damaged)
        with pytest.raises(StateError, match="not a state"):
            read_state(file)
    file.write_bytes(whole)
    file.with_name("0123456789abcdef.scene").write_bytes(b"no scene")
    file.write_bytes(b"0123456789abcdef" + whole[16:])
    with pytest.raises(StateError, match="invalid scene"):
        read_state(file)


@pytest.mark.parametrize(("scene", "frame"), [("", "eA=="), ("eA==", ""), ("?", "eA=="), ("eA==", "=")])
def test_what_is_no_base64_is_not_written(tmp_path: Path, scene: str, frame: str) -> None:
    write_state(tmp_path / "states" / "a.state", "a", scene, frame)
    assert not list(tmp_path.iterdir())
