"""Evaluations on a Ray cluster of two nodes: equal results, faults of nodes, and no process left.

The cluster is shared; the last tests kill parts of it.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.on_ray.runner import RayRunner
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, make_jobs
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile, read_results
from tests.running.evaluation.execution.on_ray.conftest import Cluster
from tests.support.processes import Process, is_running, kill
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")]

PROGRAMS = """
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from helpers import KIT

FOLDER = Path({folder!r})


class Held:
    '''Leaves a mark with its process and that of Ray, waits while there is a file `hold`, and delivers.'''

    def run(self, client):
        process = os.getppid()
        for _ in ("guard", "fork server"):  # they are between the two
            stat = Path(f"/proc/{{process}}/stat").read_text(encoding="ascii", errors="replace")
            process = int(stat.rpartition(")")[2].split()[1])
        (FOLDER / "marks" / f"{{os.getpid()}} {{process}}").touch()
        client.start_competition()
        while (FOLDER / "hold").exists():
            time.sleep(0.01)
        print("going on")
        client.sleep(1.1)
        client.control_agv(1, KIT)


class Killed:
    '''Is killed by a process that its evaluation does not know.'''

    def run(self, client):
        (FOLDER / "marks" / str(os.getpid())).touch()
        killer = f"import os; os.kill({{os.getpid()}}, {{signal.SIGKILL}})"
        subprocess.run([sys.executable, "-c", killer])
        time.sleep(60)
"""


@pytest.fixture
def marks(folder: Path) -> Path:
    """Return the folder for the marks of runs, in a working folder with a trial and programs."""
    (folder / "programs.py").write_text(PROGRAMS.format(folder=str(folder)), encoding="utf-8")
    (folder / "helpers.py").write_text("KIT = 'order_0_kit_0'\n", encoding="utf-8")
    (folder / "marks").mkdir()
    return folder / "marks"


def jobs_of(program: str) -> list[Job]:
    trial = EvaluatedTrial("tiny", (Path("tiny.yaml").resolve(),), 6.0, 6.0, 500.0, given=("tiny.yaml",))
    return make_jobs([trial], f"programs.py:{program}", [1], vary=False)


def comparable(folder: str) -> list[Result]:
    """Return the results in a folder by seed, without wall times."""
    results = read_results(Path(folder)).values()
    return sorted((replace(each, wall=0.0) for each in results), key=lambda each: each.seed)


def files(folder: str) -> dict[str, bytes]:
    """Return the logs of programs, and the names of the other files of runs."""
    paths = Path(folder).glob("*/tiny-*")
    return {str(each.relative_to(folder)): each.read_bytes() if each.suffix == ".log" else b"" for each in paths}


def command(*options: str) -> Process:
    """Start the command for the program `Held`."""
    arguments = ["eval", "tiny.yaml", "--agent", "programs.py:Held", *options]
    return Process([sys.executable, "-m", "cellwright", *arguments], os.environ, Path.cwd())


Start = Callable[..., tuple[RayRunner, ResultsFile]]


@pytest.fixture
def start(cluster: Cluster, marks: Path) -> Iterator[Start]:
    """Return a function that makes an evaluation on the cluster, whose check has been passed."""
    stores = []

    def checked(jobs: list[Job]) -> tuple[RayRunner, ResultsFile]:
        stores.append(store := ResultsFile(Path("out")))
        evaluation = RayRunner(store, cluster.address, jobs)
        assert evaluation.check_agent(jobs[0].agent) == ""
        assert evaluation.failure == ""
        return evaluation, store

    yield checked
    for store in stores:
        store.close()


def test_other_program_on_node_is_refused(cluster: Cluster, marks: Path) -> None:
    Path(".gitignore").write_text("helpers.py\n", encoding="utf-8")  # nodes do not get what Git ignores
    jobs = jobs_of("Held")
    with ResultsFile(Path("out")) as store:
        evaluation = RayRunner(store, cluster.address, jobs)
        problem = evaluation.check_agent(jobs[0].agent)
    assert "agent programs.py:Held: another program; put it below the current folder" in problem
    assert not list(marks.iterdir())


def test_run_that_is_killed_at_every_start_is_a_fault_and_no_verdict(start: Start, marks: Path) -> None:
    jobs = jobs_of("Killed")
    evaluation, store = start(jobs)
    assert not evaluation.run(jobs)
    assert [each.line for each in evaluation.lost] == [
        "tiny seed 1: killed by SIGKILL from outside; no result after 3 starts"
    ]
    assert len(list(marks.iterdir())) == 3
    assert not store.results


def test_signal_ends_runs_on_nodes(cluster: Cluster, marks: Path) -> None:
    (marks.parent / "hold").touch()
    process = command("--seeds", "2", "--ray", cluster.address)
    wait_until(lambda: len(list(marks.iterdir())) == 2, "two runs", seen=lambda: process.said)
    process.signal(signal.SIGTERM)
    assert process.finish() == 75
    assert "interrupted: 2 runs left" in process.out
    assert process.err == ""
    wait_until(lambda: not any(is_running(run) for run, _ in marked(marks)), "end of the runs")


def test_results_equal_those_of_one_machine_after_death_of_worker_and_node(cluster: Cluster, marks: Path) -> None:
    assert command("--seeds", "3", "--record", "--jobs", "2", "--out", "here").finish() == 0
    for mark in marks.iterdir():
        mark.unlink()
    hold = marks.parent / "hold"
    hold.touch()
    process = command("--seeds", "3", "--record", "--out", "out", "--ray", cluster.address)
    wait_until(lambda: len(marked(marks)) == 2, "a run on each node", seen=lambda: process.said)
    runs = {parent_of(worker): (run, worker) for run, worker in marked(marks)}
    head, other = cluster.raylets
    run, worker = runs[head]
    kill([worker])
    wait_until(lambda: not is_running(run), "end of the run with Ray's worker")
    wait_until(lambda: len(marked(marks)) == 3, "second start of that run")
    kill([other])
    wait_until(lambda: not any(map(is_running, runs[other])), "end of the run on the dead node")
    hold.unlink()
    assert process.finish() == 0, process.said
    assert process.err == ""
    assert "[3/3] tiny seed " in process.out
    assert len(marked(marks)) == 5
    assert [result.points for result in comparable("out")] == [6.0] * 3
    assert comparable("out") == comparable("here")
    assert files("out") == files("here")
    assert {Path(name).suffix for name in files("out")} == {".log", ".jsonl", ".mcap"}


def test_lost_cluster_is_a_failure_of_the_machine(cluster: Cluster, start: Start, marks: Path) -> None:
    jobs = jobs_of("Held")
    (marks.parent / "hold").touch()
    evaluation, store = start(jobs)
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(evaluation.run, jobs)
        wait_until(lambda: marked(marks), "a run")
        cluster.end()
        assert not done.result()
    assert evaluation.failure == "the connection to the cluster was lost; see out/logs/ray.log"
    assert not store.results


def marked(marks: Path) -> list[tuple[int, int]]:
    """Return the processes of runs that have begun, and the workers of Ray that started them."""
    return [(int(run), int(parent)) for run, parent in (mark.name.split() for mark in marks.iterdir())]


def parent_of(pid: int) -> int:
    stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    return int(stat.rpartition(")")[2].split()[1])
