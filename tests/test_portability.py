"""Tests of all but ROS without POSIX, as far as `elsewhere/sitecustomize.py` can imitate that here."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from cellwright.middleware import wire as link
from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmStart

ROOT = Path(link.__file__).parents[2]
"""Root of the imported package."""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="made for a Linux that pretends to be something else")

TRIAL = """\
arm: {type: ur10}
time_limit: 2
orders: {o: {announcement_condition: time, announcement_condition_value: 0, parts: {
  p: {type: gear_part, pose: {xyz: [0.1, 0, 0], rpy: [0, 0, 0]}}}}}
"""
AGENTS = """\
class Idle:
    def run(self, client):
        client.start_competition()
        client.send_arm([[1.5, 0.3, -1.1, 3.1, 3.7, -1.5, 0.0]])
        client.sleep(1.2)
        print("caf\\u00e9 \\u914d")

class Stuck:
    def run(self, client):
        client.start_competition()
        while True:
            pass
"""


CELLWRIGHT = """
import os, sys
for stream in (sys.stderr, sys.stdout):
    os.dup2(os.open(sys.argv.pop(1), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream.fileno())
    stream.reconfigure(encoding="cp1252")
from cellwright.__main__ import main
sys.argv[0] = "cellwright"
sys.exit(main())
"""
"""The command, with files for standard error and output: a warm process's output is read as UTF-8."""


def settings() -> dict[str, str]:
    """Return the variables of a Python that runs as on another system."""
    paths = [str(Path(__file__).with_name("elsewhere")), str(ROOT)]
    return {"PYTHONPATH": os.pathsep.join(paths), "PYTHONWARNDEFAULTENCODING": "1", "PYTHONIOENCODING": "cp1252"}


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[WarmStart]:
    """Yield a process that has loaded Cellwright as on another system; our modules alone see no `fork` there."""
    start = WarmStart(environment={**os.environ, **settings()})
    yield start
    start.close()


class Elsewhere:
    """The command `cellwright` in a folder."""

    def __init__(self, start: WarmStart, folder: Path) -> None:
        self._start = start
        self._folder = folder

    def __call__(self, *arguments: str, status: int = 0) -> subprocess.CompletedProcess[str]:
        """Run it to its end."""
        environment = {**os.environ, **settings()}
        with TemporaryDirectory() as folder:
            files = Path(folder, "err"), Path(folder, "out")
            ran = self._start.run(
                CELLWRIGHT, *map(str, files), *arguments, folder=self._folder, environment=environment
            )
            ran.stderr, ran.stdout = (file.read_text(encoding="cp1252") for file in files)
        return check(ran, status)


@pytest.fixture
def cellwright(elsewhere: WarmStart, tmp_path: Path) -> Elsewhere:
    return Elsewhere(elsewhere, tmp_path)


def python(folder: Path, program: str) -> subprocess.CompletedProcess[str]:
    """Start Python as on another system, in a folder."""
    ran = subprocess.run(
        [sys.executable, "-c", program],
        cwd=folder,
        env={**os.environ, **settings()},
        encoding="cp1252",
        capture_output=True,
        timeout=TIMEOUT,
        check=False,
    )
    return check(ran, 0)


def check(ran: subprocess.CompletedProcess[str], status: int) -> subprocess.CompletedProcess[str]:
    """Return a program that has ended as expected."""
    assert ran.returncode == status, ran.stdout + ran.stderr
    assert "Traceback" not in ran.stderr
    return ran


EVERYTHING = """
import importlib, pkgutil, sys, cellwright
for module in pkgutil.walk_packages(cellwright.__path__, "cellwright."):
    if not any(part in module.name for part in ("bridge", "packages.data", "packages.generate", "__main__")):
        importlib.import_module(module.name)
from cellwright.running.evaluation.execution import memory
from cellwright.running.evaluation.execution import process
from cellwright.clients.operators import terminal
assert not memory.MEMORY_IS_LIMITED and not memory.usage_below([1])
assert not hasattr(process.signal, "SIGKILL") and not hasattr(process.os, "killpg")
assert not hasattr(terminal, "termios") and terminal._read_windows() == ""
"""


@pytest.mark.slow
def test_modules_import_without_posix(tmp_path: Path) -> None:
    """All but those that are for ROS's Python: the bridges, the ROS packages' own, and the generator of interfaces."""
    python(tmp_path, EVERYTHING)


@pytest.mark.slow
def test_run_writes_log_and_checkpoint(cellwright: Elsewhere, tmp_path: Path) -> None:
    (tmp_path / "配.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    looks = ["--log", "run.jsonl", "--checkpoint", "1:half.npz", "--listen", "all", "--no-picture"]
    ran = cellwright("run", "配.yaml", "--agent", "agents.py:Idle", "--until", "1.1", *looks, status=1)
    assert "trial \\u914d" in ran.stdout + ran.stderr
    log = (tmp_path / "run.jsonl").read_bytes()
    assert b"\r" not in log
    assert all(json.loads(line) for line in log.splitlines())
    asked = ["--agent", "none", "--resume", "half.npz", "--until", "1.2", "--no-picture"]
    resumed = cellwright("run", "配.yaml", *asked)
    assert "stopped before the competition was done" in resumed.stdout


@pytest.mark.slow
def test_remote_agent_over_socket_has_in_process_result(cellwright: Elsewhere, tmp_path: Path) -> None:
    """The cell is served on the loopback, in lockstep; the same run as in one process."""
    (tmp_path / "trial.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    asked = ["run", "trial.yaml", "--agent", "agents.py:Idle", "--until", "1.1", "--json", "--no-picture"]
    alone, apart = (
        json.loads(cellwright(*asked, *more, status=1).stdout) for more in ([], ["--over", "socket", "--lockstep"])
    )
    assert apart["state_hash"] == alone["state_hash"]
    assert apart["simulated"] == pytest.approx(1.1)


@pytest.mark.slow
def test_eval_scores_runs_and_ends_stuck_one(cellwright: Elsewhere, tmp_path: Path) -> None:
    (tmp_path / "trial.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    asked = ["eval", "trial.yaml", "--out", "results", "--agent"]
    cellwright(*asked, "agents.py:Idle", status=1)
    logs = {path.suffix: path for path in (tmp_path / "results" / "logs").glob("trial-*")}
    assert "café 配" in logs[".log"].read_text(encoding="utf-8")
    assert logs[".jsonl"].read_bytes().count(b"\n") > 2
    again = cellwright(*asked, "agents.py:Idle", status=1)
    assert "gave up" in again.stdout + again.stderr
    assert len((tmp_path / "results" / "results.jsonl").read_bytes().splitlines()) == 1
    assert (tmp_path / "results" / "report.html").is_file()
    stuck = cellwright(*asked[:3], "stuck", "--agent", "agents.py:Stuck", "--time-limit", "1", status=1)
    assert "wall limit" in stuck.stdout + stuck.stderr
    assert "cannot limit the memory of a run" in stuck.stdout + stuck.stderr


@pytest.mark.slow
def test_robot_node_simulates(cellwright: Elsewhere) -> None:
    ran = cellwright("teleop", "qinglong", "--until", "0.5", "--speed", "max", "--sim-time", "--port", "0", "--json")
    assert json.loads(ran.stdout)["simulated"] == pytest.approx(0.5, abs=0.01)


REFUSED = """
import select, sys, os
from pathlib import Path
for act in (
    lambda: Path("a:b").write_text("", encoding="utf-8"),
    lambda: Path("aux.txt").write_text("", encoding="utf-8"),
    lambda: open("dot.", "w", encoding="utf-8"),
):
    try:
        act()
    except OSError:
        continue
    sys.exit("a name was taken that Windows does not take")
from cellwright.clients.client import socket_transport
for what in (((), (), ()), ([0], (), ())):
    try:
        socket_transport.select.select(*what, 0.0)
    except OSError:
        continue
    sys.exit("select took what it does not take on Windows")
"""


@pytest.mark.slow
def test_imitation_refuses_posix_features(tmp_path: Path) -> None:
    """The imitation refuses what Windows would refuse; otherwise the tests above would show nothing."""
    python(tmp_path, REFUSED)
    assert not list(tmp_path.iterdir())
