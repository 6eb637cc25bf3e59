"""Tests of the trackers of an evaluation: their metrics, and what happens to them when things fail."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from cellwright.running.evaluation.outputs import tracking
from cellwright.running.evaluation.outputs.tracking import TrackerProcess, Tracking, final_metrics, parameters_of
from cellwright.running.evaluation.results.summary import Repeat, Threshold
from cellwright.util.errors import UnknownNameError, UsageError
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked
from tests.running.evaluation.trackers import local_trackers, mlflow_history, mlflow_runs
from tests.support.quick_children import QUICK_TRACKERS
from tests.support.waiting import wait_until

__all__ = ["local_trackers"]

PLAN = {
    "agent": "my.py:Mine",
    "vary": True,
    "limits": {"wall": 600.0, "memory": 1 << 31},
    "versions": {"cellwright": "1.0"},
    "runs": [{"key": f"{name}{seed}", "trial": name, "seed": seed} for name in ("tiny", "other") for seed in (1, 2)],
}
PARAMETERS = parameters_of(PLAN, None, None)


def test_parameters_say_what_is_evaluated() -> None:
    assert PARAMETERS | {"plan": ""} == {
        "agent": "my.py:Mine",
        "trials": "tiny, other",
        "seeds": "1 to 2",
        "vary": "True",
        "limit_wall": "600.0",
        "limit_memory": "2147483648",
        "version_cellwright": "1.0",
        "plan": "",
        "shard": "1/1",
        "min_score": "none",
    }
    other = parameters_of({**PLAN, "runs": PLAN["runs"][:-1]}, None, Threshold.read("75%"))  # type: ignore[index]
    assert {name for name in PARAMETERS if PARAMETERS[name] != other[name]} == {"plan", "min_score"}


def test_final_metrics_have_intervals_overall_and_by_trial() -> None:
    results = [worked(12.0), worked(6.0, seed=2, simulated=22.0), LOST, result(6.0, trial="one")]
    metrics = final_metrics(results, Threshold.read("75%"), [Repeat(results[0], results[0])], 1)
    expected = {
        "overall/runs": 4,
        "overall/share": 0.5,
        "overall/passed": 0.25,
        "overall/exit_status": 1,
        "overall/repeatable": 1.0,
        "tiny/points": 6.0,
        "tiny/share": 0.5,
        "tiny/time": 21.0,
        "tiny/distance": 0.0042,
        "tiny/yaw_difference": 0.05,
        "one/points": 6.0,
    }
    assert {name: metrics[name] for name in expected} == pytest.approx(expected)
    for name in ("overall/passed", "tiny/points", "tiny/passed", "tiny/time"):
        assert metrics[f"{name}_low"] < metrics[name] < metrics[f"{name}_high"]
    assert "one/points_low" not in metrics


def test_metrics_of_no_results_are_a_count() -> None:
    assert final_metrics([], None, [], 75) == {"overall/runs": 0, "overall/exit_status": 75}


def test_names_of_metrics_are_legal_and_different() -> None:
    trials = ["a/tiny.yaml", "a_tiny.yaml", "overall", "progress", "7", "größe", "", "_7"]
    metrics = final_metrics([result(trial=trial) for trial in trials], None, [], 0)
    assert sum(name.endswith("/points") for name in metrics) == len(trials)
    assert all(re.fullmatch(r"[A-Za-z_]\w*/\w+", name, re.ASCII) for name in metrics)


def test_unknown_tracker_and_missing_package_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UnknownNameError, match=r"unknown tracker 'mlflw'; did you mean mlflow"):
        Tracking.require(["mlflw"])
    monkeypatch.setattr(tracking, "is_installed", lambda name: name != "wandb")
    with pytest.raises(UsageError, match=r"^wandb: needs the package wandb; pip install 'cellwright\[wandb\]'$"):
        Tracking.require(["mlflow", "wandb"])


@pytest.mark.slow
def test_progress_is_logged_and_end_without_results_is_interrupted(
    local_trackers: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking, "_PERIOD", 0.0)
    with Tracking(["mlflow"], tmp_path, PARAMETERS, Threshold.read("75%")) as trackers:
        assert trackers.begin([result()]) == ""
        (run,) = trackers.runs.values()
        for each in (worked(6.0, seed=2), LOST):
            trackers.take(each)
            assert trackers.update() == ""
            wait_until(lambda: not trackers._trackers["mlflow"]._answers.empty(), "answer to the update")
            assert trackers.update() == ""  # nothing is new
    assert mlflow_history(run, "progress/done") == [(2, 2.0), (3, 3.0)]
    assert mlflow_history(run, "progress/share") == [(2, 0.75), (3, 0.5)]
    assert mlflow_history(run, "progress/failed") == [(2, 1.0), (3, 2.0)]
    assert mlflow_runs()[0].info.status == "KILLED"


@QUICK_TRACKERS
@pytest.mark.slow
def test_tracker_that_fails_warns_once_a_minute(
    local_trackers: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking, "_PERIOD", 0.0)
    warnings: list[str] = []

    def warns() -> bool:
        trackers.take(CRASHED)
        warnings.append(trackers.update())
        return bool(warnings[-1])

    with Tracking(["mlflow"], tmp_path, PARAMETERS) as trackers:
        trackers.begin([])
        local_trackers.rename(tmp_path / "moved")
        local_trackers.write_text("no folder", encoding="utf-8")
        wait_until(warns, "warning")
        assert warnings[-1].startswith("warning: not logged to mlflow: ")
        assert warnings[-1].endswith("; the evaluation goes on")
        for _ in range(3):
            assert not warns()
        monkeypatch.setattr(tracking, "_WARNING_PERIOD", 0.0)
        wait_until(warns, "second warning")
        (note,) = trackers.finish({"overall/runs": 1.0}, 1, [], "finished")
        assert note.startswith("not logged to mlflow: ")
        assert note.endswith("; the last figures, files or status are missing there; the same command logs them")


@QUICK_TRACKERS
@pytest.mark.slow
def test_tracker_whose_process_ends_is_reported_at_once(local_trackers: Path, tmp_path: Path) -> None:
    with Tracking(["mlflow"], tmp_path, PARAMETERS) as trackers:
        trackers.begin([])
        trackers._trackers["mlflow"]._process.kill()
        trackers._trackers["mlflow"]._process.wait()
        (note,) = trackers.finish({}, 0, [], "finished")
        assert note.startswith(f"not logged to mlflow: its process has ended (see {tmp_path / 'logs' / 'mlflow.log'})")


@QUICK_TRACKERS
@pytest.mark.slow
def test_run_that_the_store_has_lost_is_replaced(local_trackers: Path, tmp_path: Path) -> None:
    file = tmp_path / "tracking.json"
    group = tracking._digest(PARAMETERS)
    file.write_text(json.dumps({"parameters": group, "runs": {"mlflow": "f" * 32, "wandb": "w"}}), encoding="utf-8")
    with Tracking(["mlflow"], tmp_path, PARAMETERS) as trackers:
        trackers.begin([])
        assert trackers.finish({"overall/runs": 0.0}, 0, [], "failed") == []
    (run,) = mlflow_runs()
    assert run.info.status == "FAILED"
    assert json.loads(file.read_text(encoding="utf-8"))["runs"] == {"mlflow": run.info.run_id, "wandb": "w"}
    with Tracking(["mlflow"], tmp_path, PARAMETERS) as trackers:
        trackers.forget()
        trackers.begin([])
        assert trackers.runs["mlflow"] != run.info.run_id
    assert [each.info.status for each in mlflow_runs()] == ["KILLED", "FAILED"]


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 100_000, '{"parameters": "1", "runs": {"mlflow": 5}}', "\x00"])
def test_damaged_file_of_runs_counts_as_none(text: str, tmp_path: Path) -> None:
    (tmp_path / "tracking.json").write_text(text, encoding="utf-8")
    assert Tracking([], tmp_path, PARAMETERS)._stored("1") == {}


def test_variables_of_the_environment_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    environments: list[dict[str, str]] = []

    def popen(*_: object, env: dict[str, str], **__: object) -> None:
        environments.append(env)
        raise OSError(11, "no process")

    monkeypatch.setattr(TrackerProcess, "_popen", staticmethod(popen))
    for name in ("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "MLFLOW_DISABLE_TELEMETRY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(OSError, match="no process"):
        Tracking(["mlflow"], tmp_path, PARAMETERS)
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "7")
    with pytest.raises(OSError, match="no process"):
        Tracking(["mlflow"], tmp_path, PARAMETERS)
    assert [each["MLFLOW_HTTP_REQUEST_MAX_RETRIES"] for each in environments] == ["2", "7"]
    assert all(each["MLFLOW_DISABLE_TELEMETRY"] == "true" for each in environments)
