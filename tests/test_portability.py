"""All but ROS runs where POSIX is not: see `elsewhere/sitecustomize.py` for what that can be made to mean here."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cellwright import link
from tests.waiting import TIMEOUT

ROOT = Path(link.__file__).parents[2]
"""Where the package is imported from."""

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


def python(folder: Path, *arguments: str, status: int = 0) -> subprocess.CompletedProcess[str]:
    """Run Python as it would be elsewhere, in a folder."""
    paths = [str(Path(__file__).with_name("elsewhere")), str(ROOT)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONWARNDEFAULTENCODING": "1"}
    ran = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**environment, "PYTHONIOENCODING": "cp1252"},
        encoding="cp1252",
        capture_output=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == status, ran.stdout + ran.stderr
    assert "Traceback" not in ran.stderr
    return ran


def cellwright(folder: Path, *arguments: str, status: int = 0) -> subprocess.CompletedProcess[str]:
    return python(folder, "-m", "cellwright", *arguments, status=status)


EVERYTHING = """
import importlib, pkgutil, sys, cellwright
for module in pkgutil.walk_packages(cellwright.__path__, "cellwright."):
    if not module.name.startswith(("cellwright.bridges", "cellwright.ros1.packages")) and "__main__" not in module.name:
        importlib.import_module(module.name)
from cellwright.evaluation import limits, worker_process
from cellwright.operators import terminal
assert not limits.MEMORY_IS_LIMITED and not limits.memory_of_sessions()
assert not hasattr(worker_process.signal, "SIGKILL") and not hasattr(worker_process.os, "killpg")
assert not hasattr(terminal, "termios") and terminal._read_windows() == ""
"""


@pytest.mark.slow
def test_every_module_can_be_imported(tmp_path: Path) -> None:
    """All but the bridge's and the ROS packages' own, which are for ROS's Python."""
    python(tmp_path, "-c", EVERYTHING)


@pytest.mark.slow
def test_a_run_its_log_and_a_checkpoint(tmp_path: Path) -> None:
    (tmp_path / "配.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    looks = ["--log", "run.jsonl", "--checkpoint", "1:half.npz", "--listen", "all", "--no-picture"]
    ran = cellwright(tmp_path, "run", "配.yaml", "--agent", "agents.py:Idle", "--until", "1.1", *looks, status=1)
    assert "trial \\u914d" in ran.stdout + ran.stderr
    log = (tmp_path / "run.jsonl").read_bytes()
    assert b"\r" not in log
    assert all(json.loads(line) for line in log.splitlines())
    asked = ["--agent", "none", "--resume", "half.npz", "--until", "1.2", "--no-picture"]
    resumed = cellwright(tmp_path, "run", "配.yaml", *asked)
    assert "stopped before the competition was done" in resumed.stdout


@pytest.mark.slow
def test_an_agent_in_a_process_of_its_own_over_a_socket(tmp_path: Path) -> None:
    """The cell served on the loopback, in lockstep; the same run as in one process."""
    (tmp_path / "trial.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    asked = ["run", "trial.yaml", "--agent", "agents.py:Idle", "--until", "1.1", "--json", "--no-picture"]
    alone, apart = (
        json.loads(cellwright(tmp_path, *asked, *more, status=1).stdout)
        for more in ([], ["--over", "socket", "--lockstep"])
    )
    assert apart["state_hash"] == alone["state_hash"]
    assert apart["simulated"] == pytest.approx(1.1)


@pytest.mark.slow
def test_runs_are_judged_and_a_stuck_one_is_ended(tmp_path: Path) -> None:
    (tmp_path / "trial.yaml").write_text(TRIAL, encoding="utf-8")
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    asked = ["eval", "trial.yaml", "--out", "results", "--agent"]
    cellwright(tmp_path, *asked, "agents.py:Idle", status=1)
    logs = {path.suffix: path for path in (tmp_path / "results" / "logs").glob("trial-*")}
    assert "café 配" in logs[".log"].read_text(encoding="utf-8")
    assert logs[".jsonl"].read_bytes().count(b"\n") > 2
    again = cellwright(tmp_path, *asked, "agents.py:Idle", status=1)
    assert "gave up" in again.stdout + again.stderr
    assert len((tmp_path / "results" / "results.jsonl").read_bytes().splitlines()) == 1
    assert (tmp_path / "results" / "report.html").is_file()
    stuck = cellwright(tmp_path, *asked, "agents.py:Stuck", "--time-limit", "1", status=1)
    assert "wall limit" in stuck.stdout + stuck.stderr
    assert "memory of a run is not limited" in stuck.stdout + stuck.stderr


@pytest.mark.slow
def test_a_robot_takes_steps(tmp_path: Path) -> None:
    ran = cellwright(
        tmp_path, "teleop", "qinglong", "--until", "0.5", "--speed", "max", "--sim-time", "--port", "0", "--json"
    )
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
from cellwright.client.transports import connection
for what in (((), (), ()), ([0], (), ())):
    try:
        connection.select.select(*what, 0.0)
    except OSError:
        continue
    sys.exit("select took what it does not take on Windows")
"""


@pytest.mark.slow
def test_the_pretence_holds(tmp_path: Path) -> None:
    """What Windows would refuse is refused; otherwise nothing above has shown anything."""
    python(tmp_path, "-c", REFUSED)
    assert not list(tmp_path.iterdir())
