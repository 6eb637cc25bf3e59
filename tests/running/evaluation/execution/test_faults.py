"""Tests of runs that the machine ends: they are repeated, and are no verdict on the program."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions, Running
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.running.remote.fork_server import ForkServer
from tests.running.evaluation.conftest import tiny_jobs
from tests.support.quick_children import QUICK_WORKERS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="no such signals, or no /dev/full, there"),
    pytest.mark.usefixtures(*QUICK_WORKERS.args),
]

PROGRAMS = '''
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

from programs import Deliver as Delivers


def note(event):
    with open("events", "a") as file:
        file.write(f"{event}\\n")


class Deliver(Delivers):
    pass


class Waits(Deliver):
    """Leaves its process id and waits, until there is a file `go`."""

    def run(self, client):
        note("start")
        new = Path(f"new-{os.getpid()}")
        new.write_text(str(os.getpid()))
        new.rename("pid")
        while not Path("go").exists():
            time.sleep(0.01)
        super().run(client)
        note("end")


class KillInThread:
    def run(self, client):
        threading.Thread(target=os.killpg, args=(0, signal.SIGKILL)).start()
        time.sleep(60)


class KilledByItsChild:
    def run(self, client):
        subprocess.run(["kill", "-KILL", str(os.getpid())])


class KilledWhenMade:
    def __init__(self):
        subprocess.run(["kill", "-KILL", str(os.getpid())])

    def run(self, client):
        pass


class FillsDisk:
    def run(self, client):
        with open("/dev/full", "w", buffering=1) as file:
            file.write("a line\\n")


class Aborts:
    def run(self, client):
        os.abort()
'''


@dataclass
class Evaluated:
    """Outcome of an evaluation."""

    is_complete: bool = False
    results: list[Result] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    unjudged: list[str] = field(default_factory=list)
    failure: str = ""


Evaluate = Callable[..., Evaluated]


@pytest.fixture
def evaluate(folder: Path) -> Evaluate:
    """Return a function that evaluates a program, and calls `look` while it works."""
    (folder / "faulty.py").write_text(PROGRAMS, encoding="utf-8")

    def run(
        program: str, seeds: int = 1, workers: int = 1, look: Callable[[Sequence[Running]], None] = lambda _: None
    ) -> Evaluated:
        found = Evaluated()
        with ResultsFile(folder / "out") as store:
            evaluation = LocalRunner(
                store,
                RunnerOptions(on_result=found.results.append, on_fault=found.faults.append, on_progress=look),
                workers=workers,
            )
            found.is_complete = evaluation.run(tiny_jobs(folder, program, seeds, "faulty.py"))
            found.unjudged, found.failure = [each.line for each in evaluation.lost], evaluation.failure
            assert list(store.results.values()) == found.results
        return found

    return run


def killer(number: int, *, times: int) -> Callable[[object], None]:
    """Return a function that kills a waiting program from outside, a number of times, and then lets it go."""
    left = times

    def look(_: object) -> None:
        nonlocal left
        pid = Path("pid")
        if not pid.exists():  # asked once: it may come at any moment
            return
        if left:
            process = int(pid.read_text())
            pid.unlink()
            left -= 1
            os.kill(process, number)
        else:
            Path("go").touch()

    return look


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_run_killed_from_outside_is_repeated_at_once(number: signal.Signals, evaluate: Evaluate) -> None:
    found = evaluate("Waits", look=killer(number, times=2))
    assert found.is_complete
    assert [(each.outcome, each.points) for each in found.results] == [("done", 6.0)]
    assert found.faults == [f"tiny seed 1: killed by {number.name} from outside; it starts again"] * 2
    assert (found.unjudged, found.failure) == ([], "")


def test_run_killed_at_every_start_has_no_result(evaluate: Evaluate) -> None:
    found = evaluate("Waits", look=killer(signal.SIGKILL, times=3))
    assert not found.is_complete
    assert found.results == []
    assert found.unjudged == ["tiny seed 1: killed by SIGKILL from outside; no result after 3 starts"]


def test_later_evaluation_does_the_run_that_was_killed(evaluate: Evaluate) -> None:
    evaluate("Waits", look=killer(signal.SIGKILL, times=3))
    assert [each.outcome for each in evaluate("Waits", look=killer(signal.SIGKILL, times=0)).results] == ["done"]


def test_killed_run_does_not_affect_others(evaluate: Evaluate) -> None:
    found = evaluate("KilledByItsChild", seeds=2, workers=2)
    assert len(found.faults) == 4
    assert sorted(line.partition(":")[0] for line in found.unjudged) == ["tiny seed 1", "tiny seed 2"]


def test_program_that_kills_its_process_in_a_thread_has_died(evaluate: Evaluate) -> None:
    (result,) = evaluate("KillInThread").results
    assert (result.outcome, result.reason) == ("died", "the process ended without a result: killed by SIGKILL")


def test_program_that_aborts_has_died(evaluate: Evaluate) -> None:
    found = evaluate("Aborts")
    assert [each.reason for each in found.results] == ["the process ended without a result: killed by SIGABRT"]
    assert found.faults == []


def test_full_disk_of_program_is_no_verdict(evaluate: Evaluate) -> None:
    found = evaluate("FillsDisk")
    assert found.results == []
    assert found.unjudged == [
        "tiny seed 1: the disk is full: OSError: [Errno 28] No space left on device; no result after 3 starts"
    ]


def test_kill_while_kernel_had_no_memory_says_so_and_runs_fewer_in_parallel(
    evaluate: Evaluate, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = iter(range(1000))
    monkeypatch.setattr("cellwright.running.evaluation.execution.process.oom_kills", lambda: next(counted))
    events, pid = Path("events"), Path("pid")
    killed: list[int] = []

    def look(_: object) -> None:
        starts = events.read_text().split() if events.exists() else []
        if len(starts) == 2 and pid.exists() and not killed:
            killed.append(int(pid.read_text()))
            os.kill(killed[0], signal.SIGKILL)
        elif len(starts) == 3:
            Path("go").touch()

    found = evaluate("Waits", seeds=4, workers=2, look=look)
    assert len(found.faults) == 1
    assert found.faults[0].endswith(": killed by SIGKILL while the machine had no memory left; it starts again")
    assert sorted(each.seed for each in found.results) == [1, 2, 3, 4]
    # the third was started in place of the killed one, before its end was looked at
    assert events.read_text().split() == ["start"] * 3 + ["end"] * 2 + ["start", "end"] * 2


class NoRoom:
    """Starter of processes that fails at some of its calls, numbered from 0."""

    def __init__(self, fails: Callable[[int], bool], start: Callable[..., Any]) -> None:
        self._fails, self._start, self.calls = fails, start, 0

    def __call__(self, *arguments: Any, **settings: Any) -> Any:
        self.calls += 1
        if self._fails(self.calls - 1):
            raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return self._start(*arguments, **settings)


def no_room(monkeypatch: pytest.MonkeyPatch, fails: Callable[[int], bool]) -> NoRoom:
    starter = NoRoom(fails, ForkServer.popen)
    monkeypatch.setattr(ForkServer, "popen", lambda *words, **options: starter(*words, **options))
    return starter


@pytest.mark.parametrize("failing", [{0, 1}, {1}, {2, 3}])
def test_process_that_cannot_be_started_is_started_later(
    failing: set[int], evaluate: Evaluate, monkeypatch: pytest.MonkeyPatch
) -> None:
    starter = no_room(monkeypatch, failing.__contains__)
    found = evaluate("Deliver", seeds=3, workers=2)
    assert found.is_complete
    assert sorted(each.seed for each in found.results) == [1, 2, 3]
    assert len(found.faults) == len(failing)
    assert "no process could be started: Resource temporarily unavailable" in found.faults[0]
    assert starter.calls == 3 + len(failing)


def test_machine_without_room_for_any_process_ends_evaluation(
    evaluate: Evaluate, monkeypatch: pytest.MonkeyPatch
) -> None:
    starter = no_room(monkeypatch, lambda number: number > 0)
    found = evaluate("Deliver", seeds=3)
    assert not found.is_complete
    assert [each.seed for each in found.results] == [1]
    assert "Resource temporarily unavailable" in found.failure
    assert starter.calls == 1 + 1 + 3  # one while the first was there, and then three


def test_check_of_agent_that_is_killed_is_no_refusal(folder: Path, evaluate: Evaluate) -> None:
    faults: list[str] = []
    with ResultsFile(folder / "out") as store:
        evaluation = LocalRunner(store, RunnerOptions(on_fault=faults.append))
        assert evaluation.check_agent("faulty.py:KilledWhenMade") == ""
        assert evaluation.failure == "killed by SIGKILL from outside"
    assert faults == ["check of the agent: killed by SIGKILL from outside"] * 3
