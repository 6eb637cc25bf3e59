"""Tests of agents in processes of their own."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import AgentError, find_agent
from cellwright.running.remote.hosting import AgentProcess, RemoteAgent
from cellwright.running.run import Outcome, RunOptions, RunResult, ServerOptions, Session, run_cell
from cellwright.running.run.result import cell_result
from tests.support.cells import KITTING
from tests.support.processes import Process
from tests.support.quick_children import QUICK_AGENTS
from tests.support.waiting import TIMEOUT, wait_until
from tests.support.warm import warm_start

AGENTS = """
import logging, os, sys, time

class Delivers:
    def run(self, client):
        logging.getLogger("robot").info("off it goes")
        print("something that the agent prints")
        client.start_competition()
        client.wait_for_order()
        client.sleep(0.3)  # the parts come to rest on the tray
        client.control_agv(1, "order_0_kit_0")

class Waits:
    def run(self, client):
        client.start_competition()
        print("waiting")
        try:
            client.wait_until(lambda: False)
        except Exception:
            print("never")

class Crashes:
    def run(self, client):
        client.sleep(0.1)
        raise ValueError("no idea")

class Exits:
    def run(self, client):
        sys.exit(3)

class Dies:
    def run(self, client):
        os._exit(7)

class Clings:
    def run(self, client):
        while True:
            try:
                client.sleep(1.0)
            except BaseException:
                time.sleep(0.1)  # for nothing: it clings on, and does not keep a core busy meanwhile

class CannotBeMade:
    def __init__(self, name):
        pass

    def run(self, client):
        pass
"""


@pytest.fixture
def agents(tmp_path: Path) -> str:
    file = tmp_path / "agents.py"
    file.write_text(AGENTS)
    return str(file)


def hosted(
    agent: str, *, lockstep: bool = False, rate: float | None = None, until: float | None = None, **more: Any
) -> RunResult:
    """Return the result of a run whose agent works in a process of its own."""
    here = ServerOptions(port=0, lockstep=lockstep)
    with Session(Cell(KITTING), serve=here, rate=rate, options=RunOptions(until=until)) as session:
        return cell_result(session.run(RemoteAgent(agent, **more)))


@pytest.mark.slow
def test_remote_agent_gives_result_of_in_process_run(agents: str) -> None:
    agent = f"{agents}:Delivers"
    here = run_cell(Cell(KITTING), find_agent(agent)())
    lines: list[str] = []
    there = hosted(agent, lockstep=True, level=20, on_message=lines.append)
    assert there.outcome is here.outcome is Outcome.DONE
    assert (there.state_hash, there.steps, there.score) == (here.state_hash, here.steps, here.score)
    assert lines == ["    0.000 s  off it goes", "something that the agent prints"]


@QUICK_AGENTS
@pytest.mark.slow
def test_run_without_lockstep_keeps_speed(agents: str) -> None:
    result = hosted(f"{agents}:Delivers", rate=5.0)
    assert result.outcome is Outcome.DONE
    assert result.score.total > 0
    assert 0.0 < result.real_time_factor < 5.1  # a slow machine falls behind, none runs ahead


@QUICK_AGENTS
@pytest.mark.slow
@pytest.mark.parametrize("lockstep", [True, False])
def test_run_stops_at_until(agents: str, lockstep: bool) -> None:
    result = hosted(f"{agents}:Waits", lockstep=lockstep, until=0.5)
    assert result.outcome is Outcome.UNTIL
    assert result.simulated == pytest.approx(0.5)


@QUICK_AGENTS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("Crashes", "ValueError: no idea\n"),
        ("Exits", "the agent exited with 3\n"),
        ("Dies", "the agent's process ended with status 7\n"),
    ],
)
def test_failing_agent_is_reported_as_crash(agents: str, name: str, error: str) -> None:
    result = hosted(f"{agents}:{name}", lockstep=True)
    assert result.outcome is Outcome.CRASHED
    assert result.error.endswith(error)
    assert "src/cellwright" not in result.error.partition("client.sleep")[0]


@QUICK_AGENTS
@pytest.mark.slow
def test_agent_that_cannot_be_made_is_refused(agents: str) -> None:
    with pytest.raises(AgentError, match="cannot be made"):
        hosted(f"{agents}:CannotBeMade", lockstep=True)


@QUICK_AGENTS
@pytest.mark.slow
def test_run_is_interrupted_while_agent_waits(agents: str) -> None:
    with Session(Cell(KITTING), serve=ServerOptions(port=0), rate=1.0) as session:
        result = session.run(RemoteAgent(f"{agents}:Waits", on_message=lambda _: session.stop.request()))
    assert result.outcome is Outcome.INTERRUPTED


@QUICK_AGENTS
@pytest.mark.slow
def test_agent_that_ignores_end_is_killed(agents: str) -> None:
    lines: list[str] = []
    child = AgentProcess(f"{agents}:Clings", ("127.0.0.1", 1), node="/agent", level=30, on_message=lines.append)
    child.end(TIMEOUT)
    with pytest.raises(AgentError, match="no server answers"):
        child.agent_exit(has_connected=False)
    result = hosted(f"{agents}:Clings", until=0.2, rate=1.0)
    assert result.outcome is Outcome.UNTIL


@pytest.mark.slow
def test_killed_parent_leaves_no_agent_process(agents: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the agent, which ignores signals, nor its child processes, nor its files."""
    files = tmp_path / "files"
    files.mkdir()
    monkeypatch.setenv("TMPDIR", str(files))
    beat = tmp_path / "beat"
    (tmp_path / "beating.py").write_text(
        "import pathlib, signal, subprocess\n"
        "class Beats:\n"
        "    def run(self, client):\n"
        "        signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "        subprocess.Popen(['sleep', '100000'], start_new_session=True)\n"
        "        while True:\n"
        f"            pathlib.Path({str(beat)!r}).write_text(str(client.time))\n"
        "            client.sleep(0.05)\n"
    )
    command = [sys.executable, "-m", "cellwright", "run", "lesson", "--over", "socket", "--no-picture"]
    parent = Process([*command, "--agent", f"{tmp_path}/beating.py:Beats"], os.environ, tmp_path, warm=warm_start())
    try:
        wait_until(beat.exists, "first beat", seen=lambda: parent.said)
        assert parent.relatives()
        parent.signal(signal.SIGKILL)
        parent.finish()
        wait_until(lambda: not parent.relatives(), "end of the agent", seen=lambda: parent.relatives())
        assert not list(files.glob("cellwright-*"))
    finally:
        parent.kill()


HOSTILE = """
import os, signal, sys, threading, time
from agents import Delivers

DEEDS = {
    "forged": lambda path: open(path, "w").write('{"parting": "refused", "error": "no such agent"}'),
    "cut": lambda path: open(path, "w").write('{"parting": "ret'),
    "of_another_kind": lambda path: open(path, "w").write('{"parting": ["returned"], "error": {}}'),
    "nested": lambda path: open(path, "w").write("[" * 200_000),
    "a_pipe": os.mkfifo,
    "a_folder": os.mkdir,
    "a_link": lambda path: os.symlink("/dev/zero", path),
    "missing": lambda path: None,
}

class Lies(Delivers):
    def run(self, client):
        super().run(client)
        client.wait_until(lambda: client.score > 0)
        DEEDS[os.environ["DEED"]](sys.argv[6])
        sys.stdout.flush()
        os._exit(0)

class Threads(Delivers):
    def run(self, client):
        super().run(client)
        threading.Thread(target=time.sleep, args=(600,)).start()

class Forks(Delivers):
    def run(self, client):
        super().run(client)
        if os.fork() == 0:
            os.setsid()
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            time.sleep(600)
"""


@pytest.fixture
def hostile(agents: str) -> str:
    file = Path(agents).with_name("hostile.py")
    file.write_text(HOSTILE)
    return str(file)


@QUICK_AGENTS
@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no mkfifo")
@pytest.mark.parametrize(
    "deed", ["forged", "cut", "of_another_kind", "nested", "a_pipe", "a_folder", "a_link", "missing"]
)
def test_run_with_forged_report_keeps_score(hostile: str, monkeypatch: pytest.MonkeyPatch, deed: str) -> None:
    monkeypatch.setenv("DEED", deed)
    result = hosted(f"{hostile}:Lies", lockstep=True)
    assert result.score.total > 0.0
    assert result.outcome is Outcome.CRASHED
    assert result.error == "the agent's process ended with status 0\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only there a process can take on orphans")
@pytest.mark.parametrize("name", ["Threads", "Forks"])
def test_run_ends_with_agent_despite_leftover_processes(hostile: str, name: str) -> None:
    lines: list[str] = []
    result = hosted(f"{hostile}:{name}", lockstep=True, on_message=lines.append)
    assert (result.outcome, result.error) == (Outcome.DONE, "")
    assert result.score.total > 0.0
    left = (
        "the agent left a process running, now ended: " if name == "Forks" else "threads left running, ended with the"
    )
    assert any(left in line for line in lines)
