"""Tests of a killed evaluation: it loses nothing, repeats nothing, and leaves no process behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cellwright.cli.main import main
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.results.results_file import ResultsFile
from tests.support.processes import is_running
from tests.support.quick_children import QUICK_WORKERS
from tests.support.waiting import TIMEOUT, wait_until
from tests.support.warm import WarmProcess, warm_start

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")

ARGUMENTS = ("eval", "tiny.yaml", "--seeds", "4", "--jobs", "2", "--out", "out", "--agent")

RUNNING: list[WarmProcess] = []


def results(folder: Path) -> list[str]:
    file = folder / "out" / "results.jsonl"
    return file.read_text().splitlines() if file.exists() else []


def children(process: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == process:
                found.append(int(entry.name))
    return found


def guards(evaluation: int) -> list[int]:
    """Return the guards of the workers of an evaluation: the children of its fork server."""
    return [guard for server in children(evaluation) for guard in children(server)]


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Check that no process of a test outlives it, however the test ended."""
    RUNNING.clear()
    yield
    for process in RUNNING:
        process.kill()
        process.wait(TIMEOUT)
        if process.stdout is not None:
            process.stdout.close()


def start(folder: Path, program: str) -> WarmProcess:
    """Start the command; its workers start as in the product."""
    command = [sys.executable, "-m", "cellwright", *ARGUMENTS, f"programs.py:{program}"]
    process = warm_start().popen(command, folder=folder, environment=os.environ, stderr=subprocess.STDOUT)
    RUNNING.append(process)
    return process


@pytest.fixture
def here(capfdbinary: pytest.CaptureFixture[bytes]) -> Callable[[str], tuple[int, bytes]]:
    """Return a function that runs the command in this process: its exit status and its output."""

    def run(program: str) -> tuple[int, bytes]:
        status = main([*ARGUMENTS, f"programs.py:{program}"])
        return status, b"".join(capfdbinary.readouterr())

    return run


@QUICK_WORKERS
@pytest.mark.slow
def test_killed_evaluation_resumes_without_losing_results(
    folder: Path, here: Callable[[str], tuple[int, bytes]]
) -> None:
    (folder / "hold").touch()
    killed = start(folder, "Noted")
    wait_until(lambda: results(folder), "first result")
    wait_until(lambda: len(guards(killed.pid)) == 2, "two workers")
    workers = [*children(killed.pid), *guards(killed.pid)]
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    wait_until(lambda: not any(map(is_running, workers)), "end of server and workers")
    before = results(folder)
    assert 1 <= len(before) < 4
    with (folder / "out" / "results.jsonl").open("a") as file:
        file.write(before[0][: len(before[0]) // 2])  # as if the process had been killed while it wrote

    (folder / "hold").unlink()
    status, out = here("Noted")
    assert status == 0, out
    verb = "has" if len(before) == 1 else "have"
    assert f"{len(before)} of them {verb} a result already".encode() in out
    after = results(folder)
    assert after[: len(before)] == before
    seeds = [json.loads(line)["seed"] for line in after]
    assert sorted(seeds) == [1, 2, 3, 4]
    _, out = here("Noted")
    assert b"4 of them have a result already" in out
    assert results(folder) == after


@pytest.mark.slow
def test_hanging_workers_end_with_killed_evaluation(folder: Path) -> None:
    killed = start(folder, "Hang")
    wait_until(lambda: len(list((folder / "out").glob("logs/tiny-*.log"))) == 2, "two logs")
    wait_until(lambda: len(guards(killed.pid)) == 2, "two workers")  # a log exists before its worker
    workers = [*children(killed.pid), *guards(killed.pid)]
    killed.kill()
    killed.communicate()
    wait_until(lambda: not any(map(is_running, workers)), "end of server and workers")
    assert results(folder) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_evaluation_and_keeps_results(number: int, folder: Path) -> None:
    (folder / "hold").touch()
    process = start(folder, "Noted")
    wait_until(lambda: results(folder), "first result")
    workers = [*children(process.pid), *guards(process.pid)]
    process.send_signal(number)
    out, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 75
    assert "Traceback" not in out
    assert "interrupted: " in out
    wait_until(lambda: not any(map(is_running, workers)), "end of server and workers")
    written = json.loads((folder / "out" / "summary.json").read_text())
    assert written["runs"] == len(results(folder))
    assert (folder / "out" / "report.html").exists()


@pytest.mark.slow
def test_evaluation_that_ends_with_its_check_leaves_no_server(folder: Path) -> None:
    before = children(os.getpid())
    with ResultsFile(folder / "out") as store:
        evaluation = LocalRunner(store)
        assert evaluation.check_agent("programs.py:Deliver") == ""
        assert children(os.getpid()) == before


@QUICK_WORKERS
@pytest.mark.slow
def test_second_evaluation_in_folder_is_refused(folder: Path, here: Callable[[str], tuple[int, bytes]]) -> None:
    first = start(folder, "Hang")
    wait_until((folder / "out" / "logs").exists, "folder of logs")
    status, out = here("Hang")
    assert status == 2
    assert b"error: out: in use by another evaluation" in out
    os.kill(first.pid, signal.SIGINT)
    first.communicate(timeout=TIMEOUT)
