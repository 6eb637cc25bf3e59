"""Tests of what runs on a node, without Ray: this process is the node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from cellwright.config.parsing.overrides import Override
from cellwright.running.evaluation.execution.on_ray import node
from cellwright.running.evaluation.plan import job as job_module
from cellwright.running.evaluation.plan.job import (
    EvaluatedTrial,
    Job,
    RunLimits,
    agent_digest,
    key_facts,
    make_jobs,
    repeated,
)
from cellwright.running.evaluation.results.state import read_state, state_file
from tests.support.quick_children import QUICK_WORKERS

LIMITS = asdict(RunLimits())


def jobs_of(program: str, *overrides: str) -> list[Job]:
    file, values = Path("tiny.yaml"), tuple(map(Override.read, overrides))
    trial = EvaluatedTrial("tiny", (file.resolve(),), 6.0, 6.0, 500.0, given=(str(file),), overrides=values)
    return make_jobs([trial], f"programs.py:{program}", [1], vary=False)


def described(job: Job) -> dict[str, Any]:
    trial = job.trial
    figures = {"reachable": trial.reachable, "best": trial.best, "time_limit": trial.time_limit}
    return {
        "name": trial.name,
        "given": list(trial.given),
        **figures,
        "overrides": list(map(str, trial.overrides)),
        "facts": key_facts(trial, agent_digest(job.agent)),
    }


def order(job: Job, **changes: Any) -> dict[str, Any]:
    fields = {"key": job.key, "agent": job.agent, "trial": described(job), "seed": job.seed, "vary": job.vary}
    fields |= {"latency": job.latency}
    return {**fields, "limits": LIMITS, "records": False, "over": job.over, "verify": job.verify, **changes}


@pytest.fixture(autouse=True)
def without_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the watch that ends the process of a node."""
    monkeypatch.setattr(node, "_end_with_node", lambda: None)


@QUICK_WORKERS
@pytest.mark.slow
def test_work_returns_result_and_files_of_run(folder: Path) -> None:
    (job,) = jobs_of("Deliver")
    done = node.work(order(job))
    assert (done["result"]["outcome"], done["result"]["points"], done["result"]["key"]) == ("done", 6.0, job.key)
    assert done["result"]["command"] == job.command
    assert set(done["files"]) == {f"logs/{Path(job.log_name).stem}{suffix}" for suffix in (".log", ".jsonl")}
    assert b"sending the kit" in done["files"][f"logs/{job.log_name}"]


@QUICK_WORKERS
@pytest.mark.slow
def test_work_returns_last_state_of_run_that_lost_points(folder: Path) -> None:
    (job,) = jobs_of("Deliver", "time_limit=0.5")
    done = node.work(order(job))
    assert (done["result"]["outcome"], done["result"]["overrides"]) == ("time_limit", {"time_limit": "0.5"})
    for name, content in done["files"].items():
        path = Path("copy", name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    last = read_state(state_file(Path("copy"), job.log_name)).frame
    assert last.time == round(done["result"]["simulated"] * 1e9)


@QUICK_WORKERS
@pytest.mark.slow
def test_work_does_repetition_under_its_own_key(folder: Path) -> None:
    again = repeated(jobs_of("Deliver")[0])
    assert node.work(order(again))["result"]["key"] == again.key


@QUICK_WORKERS
@pytest.mark.slow
def test_fault_of_machine_is_raised(folder: Path) -> None:
    source = (folder / "programs.py").read_text(encoding="utf-8")
    killed = (
        "\n\nclass Killed:\n    def run(self, client):\n        subprocess.run(['kill', '-KILL', str(os.getpid())])\n"
    )
    (folder / "programs.py").write_text(source + killed, encoding="utf-8")
    with pytest.raises(node.MachineFaultError, match="killed by SIGKILL from outside"):
        node.work(order(jobs_of("Killed")[0]))


@QUICK_WORKERS
@pytest.mark.slow
def test_agent_that_cannot_be_made_on_node_has_no_verdict(folder: Path) -> None:
    done = node.work(order(jobs_of("CannotBeMade")[0]))
    assert set(done) == {"failure"}
    assert "cannot be made: OSError: no map found" in done["failure"]


@QUICK_WORKERS
@pytest.mark.slow
def test_program_that_dies_has_a_verdict(folder: Path) -> None:
    done = node.work(order(jobs_of("Quit")[0]))
    assert done["result"]["outcome"] == "died"


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(("program", "problem"), [("Deliver", ""), ("CannotBeMade", "no map found")])
def test_check_returns_problem_of_agent(folder: Path, program: str, problem: str) -> None:
    (job,) = jobs_of(program)
    checked = node.check(job.agent, job.program, [described(job)], LIMITS)["checked"]
    assert problem in checked
    assert bool(checked) == bool(problem)


def without(name: str) -> Callable[[], None]:
    return Path(name).unlink


def rewritten(name: str) -> Callable[[], object]:
    return lambda: Path(name).write_text(Path(name).read_text(encoding="utf-8") + "\n# more\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (rewritten("programs.py"), "agent programs.py:Deliver: another program"),
        (without("programs.py"), "agent programs.py:Deliver: another program"),
        (rewritten("tiny.yaml"), "trial tiny: other files"),
        (without("tiny.yaml"), "put all of its files below the current folder"),
    ],
)
def test_other_files_on_node_are_named(folder: Path, change: Callable[[], object], words: str) -> None:
    (job,) = jobs_of("Deliver")
    sent = order(job)
    change()
    assert words in node.work(sent)["failure"]
    assert words in node.check(job.agent, job.program, [sent["trial"]], LIMITS)["checked"]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("versions", lambda: {"cellwright": "9", "mujoco": "4"}, "cellwright 9, but 8 here; install the same version"),
        ("_cellwright_digest", lambda: "other", "other sources of Cellwright"),
    ],
)
def test_other_installation_on_node_is_named(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: object, words: str
) -> None:
    monkeypatch.setattr(job_module, "versions", lambda: {"cellwright": "8", "mujoco": "4"})
    sent = order(jobs_of("Deliver")[0])
    monkeypatch.setattr(job_module, "versions", lambda: {"cellwright": "8", "mujoco": "4"})
    monkeypatch.setattr(job_module, name, value)
    assert words in node.work(sent)["failure"]


def test_key_of_earlier_files_is_refused(folder: Path) -> None:
    failure = node.work(order(jobs_of("Deliver")[0], key="0" * 24))["failure"]
    assert failure == "trial or program have changed since the evaluation began; repeat the command"
