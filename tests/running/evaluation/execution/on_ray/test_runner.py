"""Tests of an evaluation on Ray before it has a cluster: refused files, a missing package, and addresses."""

from __future__ import annotations

import socket
from importlib.util import find_spec
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.on_ray import runner as module
from cellwright.running.evaluation.execution.on_ray.runner import RayRunner
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, make_jobs
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError
from tests.support.ports import free_port


def jobs_of(agent: str = "programs.py:Deliver", trial: str = "tiny.yaml") -> list[Job]:
    return make_jobs(
        [EvaluatedTrial("tiny", (Path(trial).resolve(),), 6.0, 6.0, 500.0, given=(trial,))], agent, [1], vary=False
    )


def made(jobs: list[Job]) -> RayRunner:
    with ResultsFile(Path("out")) as store:
        return RayRunner(store, "auto", jobs)


@pytest.mark.parametrize("name", ["../elsewhere/programs.py", "{folder}/programs.py"])
def test_program_that_nodes_do_not_get_is_refused(folder: Path, name: str) -> None:
    name = name.format(folder=folder)
    with pytest.raises(UsageError) as refused:
        made(jobs_of(f"{name}:Deliver"))
    reason = "nodes get the current folder only; give a file below it, by its relative path"
    assert str(refused.value) == f"--ray: {name}: {reason}"


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ("{elsewhere}/programs.py:Deliver", "{elsewhere}/programs.py"),
        ("hold --policy-map {elsewhere}/map.yaml", "{elsewhere}/map.yaml"),
        ("hold --latency file:{elsewhere}/times.txt", "{elsewhere}/times.txt"),
    ],
)
def test_file_of_a_policy_that_nodes_do_not_get_is_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, options: str, name: str
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    for each in ("programs.py", "map.yaml", "times.txt"):
        (elsewhere / each).write_text("7\n")
    jobs = jobs_of(f"policy --policy {options.format(elsewhere=elsewhere)}")
    with pytest.raises(UsageError, match=f"--ray: {name.format(elsewhere=elsewhere)}: nodes get the current folder"):
        made(jobs)


def test_file_of_a_compared_latency_that_nodes_do_not_get_is_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    times = tmp_path_factory.mktemp("elsewhere") / "times.txt"
    times.write_text("7\n")
    trial = EvaluatedTrial("tiny", (Path("tiny.yaml").resolve(),), 6.0, 6.0, 500.0, given=("tiny.yaml",))
    latencies = ["10ms", f"file:{times}"]
    with pytest.raises(UsageError, match=f"--ray: {times}: nodes get the current folder"):
        made(make_jobs([trial], "policy --policy hold --policy-map aloha", [1], vary=False, latencies=latencies))


def test_trial_that_nodes_do_not_get_is_refused(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    other = tmp_path_factory.mktemp("other") / "tiny.yaml"
    other.write_bytes(Path("tiny.yaml").read_bytes())
    with pytest.raises(UsageError, match=r"--ray: .*tiny\.yaml: nodes get the current folder only"):
        made(jobs_of(trial=str(other)))


def test_missing_package_is_refused_with_remedy(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None if name == "ray" else find_spec(name))
    with pytest.raises(UsageError) as refused:
        made(jobs_of())
    assert str(refused.value) == "--ray: needs the package ray; pip install 'cellwright[ray]'"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("127.0.0.1:{port}", "cannot be reached: Connection refused; start Ray there"),
        ("ray://127.0.0.1:{port}", "cannot be reached: Connection refused; start Ray there"),
        ("127.0.0.1:99999", "cannot be reached: "),
    ],
)
def test_address_without_cluster_is_a_problem(folder: Path, address: str, reason: str) -> None:
    address = address.format(port=free_port())
    problem, evaluation = checked(address)
    assert problem.startswith(f"--ray {address}: {reason}")
    assert evaluation.failure == ""


@pytest.mark.slow
def test_address_that_does_not_answer_is_a_problem(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CONNECT_TIMEOUT", 3.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        problem, _ = checked(address)
    assert problem == f"--ray {address}: no answer within 3 s; see out/logs/ray.log, and start Ray there"


def checked(address: str) -> tuple[str, RayRunner]:
    jobs = jobs_of()
    with ResultsFile(Path("out")) as store:
        evaluation = RayRunner(store, address, jobs)
        return evaluation.check_agent(jobs[0].agent), evaluation


@pytest.mark.parametrize(
    ("out", "excluded"),
    [
        ("out", ["*.mcap", "/out"]),
        ("shards/[1] *", ["*.mcap", r"/shards/\[1\]\ \*"]),
        (".", ["*.mcap"]),
        ("../out", ["*.mcap"]),
    ],
)
def test_output_and_recordings_are_not_sent(folder: Path, out: str, excluded: list[str]) -> None:
    assert module._excluded(Path(out)) == excluded
