"""Run log: complete when the run is, readable after a kill, and never a reason for a run to fail."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.config.trial.trial import Trial
from cellwright.recording.format.run_log import RunLog
from cellwright.running.run import RecordOptions, RunResult, run_cell
from cellwright.util.files import read_json_lines
from tests.support.cells import KITTING
from tests.support.waiting import TIMEOUT

KILLED = """
class Works:
    def run(self, client):
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")
        client.sleep(1.0)
        print("reported", flush=True)
        while True:
            client.sleep(0.01)
"""


class Delivers:
    """Agent that submits the kit on tray 1, and an empty tray as a kit that no order asked for."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(2, "order_0_kit_9")
        client.sleep(0.1)
        client.control_agv(1, "order_0_kit_0")


def logged(
    path: Path, trial: Trial = KITTING, report: list[str] | None = None
) -> tuple[RunResult, list[dict[str, Any]]]:
    reported = [] if report is None else report
    log = RunLog(path, about={"agent": "delivers"}, report=reported.append)
    return run_cell(Cell(trial, seed=5), Delivers(), record=RecordOptions(log=log)), read_json_lines(
        path
    ) if path.is_file() else []


def test_log_has_run_events_and_result(tmp_path: Path) -> None:
    result, lines = logged(tmp_path / "a.jsonl")
    kinds = [line["kind"] for line in lines]
    assert kinds[:5] == ["run", "state", "state", "conveyor", "population"]
    assert kinds[5] == "order"
    assert kinds[-1] == "result"
    first, last = lines[0], lines[-1]
    assert (first["trial"], first["seed"], first["servo"], first["agent"]) == ("kitting", 5, "original", "delivers")
    assert (first["timestep"], first["time"], first["format"]) == (0.002, 0.0, 1)
    assert set(first["versions"]) == {"cellwright", "mujoco", "numpy", "python", "platform"}
    assert (first["best"], first["reachable"], first["system_cost"]) == (6.0, 6.0, 0.0)
    assert (last["outcome"], last["state_hash"]) == (result.outcome.name.lower(), result.state_hash)
    assert last["score"]["total"] == result.score.total
    times = [line["time"] for line in lines]
    assert times == sorted(times)


def test_log_of_submission_has_evidence(tmp_path: Path) -> None:
    _, lines = logged(tmp_path / "a.jsonl")
    refused, judged = [line for line in lines if line["kind"] == "kit"]
    assert (refused["kit_type"], refused["evidence"]) == ("order_0_kit_9", None)
    assert "belongs to no order" in refused["refusal"]
    assert (judged["refusal"], judged["repeated"], judged["tray_id"]) == (
        None,
        False,
        "agv1::kit_tray_1::kit_tray_1::tray",
    )
    assert judged["evidence"]["total"] == judged["evidence"]["reachable"] == 6.0
    assert [part["cause"] for part in judged["evidence"]["parts"]] == ["placed", "placed"]


def test_log_does_not_change_run(tmp_path: Path) -> None:
    result, _ = logged(tmp_path / "a.jsonl")
    cell = Cell(KITTING, seed=5)
    listeners = list(cell.competition.on_effect)
    plain = run_cell(cell, Delivers())
    assert plain.state_hash == result.state_hash
    run_cell(cell, Delivers(), record=tmp_path / "b.jsonl")
    assert cell.competition.on_effect == listeners


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no device that is always full")
def test_full_disk_is_reported_and_does_not_end_run() -> None:
    reported: list[str] = []
    result, _ = logged(Path("/dev/full"), report=reported)
    assert result.score.total == 6.0
    assert len(reported) == 1


@pytest.mark.slow
def test_log_after_sigkill_has_all_events_so_far(tmp_path: Path) -> None:
    (tmp_path / "works.py").write_text(KILLED)
    command = [sys.executable, "-m", "cellwright", "run", "lesson", "--agent", "works.py:Works", "--log", "a.jsonl"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            assert any(line.strip() == "reported" for line in process.stdout)
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait(TIMEOUT)
    lines = read_json_lines(tmp_path / "a.jsonl")
    assert [line["kind"] for line in lines][:6] == ["run", "state", "state", "conveyor", "population", "order"]
    (judged,) = [line for line in lines if line["kind"] == "kit"]
    assert judged["evidence"]["reachable"] == 8.0
    assert [part["cause"] for part in judged["evidence"]["parts"]] == ["missing"] * 4
