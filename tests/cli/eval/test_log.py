"""Tests of `cellwright eval --log`: runs in MLflow and Weights & Biases."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from tests.cli.conftest import CommandLine
from tests.running.evaluation.programs import PROGRAMS, TRIAL
from tests.running.evaluation.trackers import local_trackers, mlflow_history, mlflow_runs, wandb_runs
from tests.support.ports import free_port
from tests.support.quick_children import QUICK_TRACKERS, QUICK_WORKERS

__all__ = ["local_trackers"]

BREAKS = """
import os

class Breaks(Deliver):
    def run(self, client):
        super().run(client)
        if not os.path.exists("moved"):
            os.rename("mlruns", "moved")
            with open("mlruns", "w") as file:
                file.write("no folder")
"""


@pytest.fixture
def tiny(cellwright: CommandLine, local_trackers: Path) -> CommandLine:
    Path("tiny.yaml").write_text(TRIAL, encoding="utf-8")
    Path("programs.py").write_text(PROGRAMS + BREAKS, encoding="utf-8")
    return cellwright


WORK = ("eval", "tiny.yaml", "--jobs", "1", "--agent", "programs.py:Deliver")


@QUICK_TRACKERS
@QUICK_WORKERS
@pytest.mark.slow
def test_evaluation_is_one_run_in_each_tracker(tiny: CommandLine, tmp_path: Path) -> None:
    work = (*WORK, "--log", "mlflow", "--log", "wandb", "--parquet", "--json")
    ran = tiny(*work)
    assert ran.status == 0
    json.loads(ran.out)
    (run,) = mlflow_runs()
    assert run.info.status == "FINISHED"
    assert (run.data.params["agent"], run.data.params["trials"]) == ("programs.py:Deliver", "tiny")
    assert run.data.metrics["tiny/points"] == 6.0
    assert run.data.metrics["overall/exit_status"] == 0.0
    names = ["junit.xml", "report.html", "results.jsonl", "results.parquet", "summary.json"]
    artifacts = Path(run.info.artifact_uri.removeprefix("file://"))
    assert sorted(each.name for each in artifacts.iterdir()) == names
    for name in names:
        assert (artifacts / name).read_bytes() == Path("evaluation", name).read_bytes()
    assert mlflow_history(run.info.run_id, "progress/done")[-1] == (1, 1.0)
    (logged,) = wandb_runs(tmp_path)
    assert (logged["project"], logged["exit"], logged["files"]) == ("cells", 0, set(names))
    assert logged["config"]["agent"] == "programs.py:Deliver"
    assert (logged["summary"]["tiny/points"], logged["history"][-1]["progress/done"]) == (6.0, 1)
    assert logged["host"] == ""
    assert f"mlflow      run {run.info.run_id}\nwandb       run {logged['id']}\n" in ran.err
    assert "wandb:" not in ran.err

    assert tiny(*work).status == 0
    (again,) = mlflow_runs()
    assert (again.info.run_id, again.info.status) == (run.info.run_id, "FINISHED")
    first, second = wandb_runs(tmp_path)  # W&B cannot continue a run that is not uploaded
    assert first["id"] != second["id"]
    assert first["group"] == second["group"]

    assert tiny(*WORK, "--log", "mlflow", "--min-score", "7").status == 1
    assert len(mlflow_runs()) == 2
    assert mlflow_runs()[0].data.metrics["overall/exit_status"] == 1.0


@QUICK_TRACKERS
@QUICK_WORKERS
@pytest.mark.slow
def test_tracker_that_fails_in_the_middle_does_not_change_the_evaluation(tiny: CommandLine) -> None:
    work = (*WORK[:-1], "programs.py:Breaks", "--log", "mlflow")
    ran = tiny(*work)
    assert ran.status == 0
    assert "warning: not logged to mlflow: " in ran.out
    assert "the same command logs them" in ran.out
    assert json.loads(Path("evaluation", "summary.json").read_text(encoding="utf-8"))["passed"] == 1
    Path("mlruns").unlink()
    Path("moved").rename("mlruns")
    assert mlflow_runs()[0].info.status == "RUNNING"
    assert "warning" not in tiny(*work).out
    (run,) = mlflow_runs()
    assert (run.info.status, run.data.metrics["tiny/points"]) == ("FINISHED", 6.0)


@QUICK_TRACKERS
@QUICK_WORKERS
@pytest.mark.slow
def test_interrupted_evaluation_is_marked_and_continues(tiny: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    work = (*WORK, "--log", "mlflow")
    with monkeypatch.context() as patch:
        patch.setattr(LocalRunner, "run", lambda _self, _jobs: False)  # as if a signal came at once
        assert tiny(*work).status == 75
    assert mlflow_runs()[0].info.status == "KILLED"
    assert tiny(*work).status == 0
    (run,) = mlflow_runs()
    assert run.info.status == "FINISHED"


@QUICK_TRACKERS
@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("tracker", "variables", "remedy"),
    [
        (
            "mlflow",
            {"MLFLOW_TRACKING_URI": "http://127.0.0.1:PORT"},
            "set MLFLOW_TRACKING_URI to a server that answers",
        ),
        (
            "wandb",
            {
                "WANDB_BASE_URL": "http://127.0.0.1:PORT",
                "WANDB_MODE": "online",
                "WANDB_API_KEY": "0" * 40,
                "WANDB_INIT_TIMEOUT": "1",
            },
            "check the network and `wandb login`, or set WANDB_MODE=offline",
        ),
    ],
)
def test_tracker_that_cannot_be_reached_starts_nothing(
    tracker: str, variables: dict[str, str], remedy: str, tiny: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port()
    for name, value in variables.items():
        monkeypatch.setenv(name, value.replace("PORT", str(port)))
    ran = tiny(*WORK, "--log", tracker)
    assert ran.status == 2
    assert ran.err.startswith(f"error: --log {tracker}: no run can be logged: ")
    assert f"127.0.0.1:{port}" in ran.err or f"port={port}" in ran.err
    assert ran.err.endswith(f"; {remedy}\n")
    assert "[1/1]" not in ran.out
    assert Path("evaluation", "results.jsonl").read_bytes() == b""


def test_bad_tracker_is_refused_before_anything(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = cellwright(*WORK, "--log", "tensorboard")
    assert (ran.status, ran.err) == (2, "error: --log: unknown tracker 'tensorboard' (known: mlflow, wandb)\n")
    monkeypatch.setitem(sys.modules, "mlflow", None)  # as if it was not installed
    ran = cellwright(*WORK, "--log", "mlflow")
    message = "error: --log mlflow: needs the package mlflow; pip install 'cellwright[mlflow]'\n"
    assert (ran.status, ran.err) == (2, message)
    assert list(Path().iterdir()) == []
