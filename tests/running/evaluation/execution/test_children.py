"""Processes that a program starts, hides or stops: none outlives its run, and each run ends."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import EvaluatedTrial, RunLimits, make_jobs
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.support.processes import is_running
from tests.support.waiting import wait_until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="only there a process can take on orphans"),
]

PROGRAMS = '''
import os
import signal
import subprocess
import time
from pathlib import Path

from programs import Deliver

def wait_for(number):
    while not Path("left.txt").exists() or len(Path("left.txt").read_text().split()) < number:
        time.sleep(0.01)


def detach(number=1):
    """Start processes in sessions of their own, whose parents end at once."""
    start = f"for i in $(seq {number}); do setsid sh hidden.sh & done"
    subprocess.run(["sh", "-c", start], check=True)
    wait_for(number)


class Detaches(Deliver):
    def run(self, client):
        detach()
        super().run(client)


class Bombs(Deliver):
    def run(self, client):
        detach(100)
        super().run(client)


class Daemonises(Deliver):
    """Forks twice, in a session of its own, and ignores all signals that can be ignored."""

    def run(self, client):
        if not os.fork():
            os.setsid()
            if os.fork():
                os._exit(0)
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
                signal.signal(number, signal.SIG_IGN)
            with open("left.txt", "a") as file:
                file.write(f"{os.getpid()} ")
            time.sleep(600)
        wait_for(1)
        super().run(client)


class StopsItself(Deliver):
    def run(self, client):
        detach()
        os.kill(os.getpid(), signal.SIGSTOP)


class StopsItsGuard(Deliver):
    def run(self, client):
        detach()
        os.kill(os.getppid(), signal.SIGSTOP)
        super().run(client)


class KillsItsGuard(Deliver):
    def run(self, client):
        detach()
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(600)


class KillsItsGroup(Deliver):
    def run(self, client):
        detach()
        os.killpg(0, signal.SIGKILL)


class IgnoresSignals(Deliver):
    def run(self, client):
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, signal.SIG_IGN)
        detach()
        super().run(client)
        while True:
            try:
                client.sleep(1.0)
            except BaseException:
                time.sleep(0.1)
'''

HIDDEN = "trap '' TERM INT HUP; echo $$ >> left.txt; while :; do sleep 600; done"
Evaluate = Callable[..., Result]


@pytest.fixture
def evaluate(folder: Path) -> Evaluate:
    """Return a function that evaluates a program once, and checks that nothing of it is left."""
    (folder / "hiding.py").write_text(PROGRAMS)
    (folder / "hidden.sh").write_text(HIDDEN)

    def run(program: str, over: str, **limits: float) -> Result:
        trial = EvaluatedTrial("tiny", (folder / "tiny.yaml",), 6.0, 6.0, 500.0)
        with ResultsFile(folder / "out") as store:
            evaluation = LocalRunner(store, RunnerOptions(RunLimits(**limits)))  # type: ignore[arg-type]
            assert evaluation.run(make_jobs([trial], f"hiding.py:{program}", [1], vary=False, over=over))
            (result,) = store.results.values()
        left = [int(number) for number in Path("left.txt").read_text().split()]
        assert left
        wait_until(lambda: not any(map(is_running, left)), "end of what the program has left behind")
        return result

    return run


@pytest.mark.parametrize("over", ["", "socket"])
@pytest.mark.parametrize("program", ["Detaches", "Bombs", "Daemonises", "StopsItsGuard"])
def test_detached_processes_end_with_their_run(program: str, over: str, evaluate: Evaluate) -> None:
    result = evaluate(program, over, memory=8 << 30)
    assert (result.outcome, result.points) == ("done", 6.0), result


@pytest.mark.parametrize(
    ("program", "over", "outcome"),
    [
        ("StopsItself", "", "died"),
        ("StopsItself", "socket", "crashed"),
        ("KillsItsGuard", "", "died"),
        ("KillsItsGuard", "socket", "crashed"),
        ("KillsItsGroup", "", "died"),
        ("KillsItsGroup", "socket", "crashed"),
        ("IgnoresSignals", "socket", "done"),
    ],
)
def test_program_that_attacks_processes_ends_its_run_alone(
    program: str, over: str, outcome: str, evaluate: Evaluate
) -> None:
    result = evaluate(program, over)
    assert result.outcome == outcome, result
