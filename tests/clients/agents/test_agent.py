from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent, AgentError, find_agent
from cellwright.clients.agents.lesson import LessonAgent
from cellwright.running.run import Outcome, run_cell
from tests.support.cells import KITTING

ROBOT = """
from dataclasses import dataclass
from neighbour import KIT

@dataclass
class Robot:
    sent: str = KIT

    def run(self, client):
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, self.sent)

class WithArgument:
    def __init__(self, tool):
        self.tool = tool

    def run(self, client):
        pass

class Unprintable(Exception):
    def __str__(self):
        raise RuntimeError

class Failing(Robot):
    def __init__(self):
        raise Unprintable

class Async:
    async def run(self, client):
        pass

class Stepwise:
    def run(self, client):
        yield

class NoAgent:
    pass

def run_fast(client):
    pass

NUMBER = 7
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "my_robot.py").write_text(ROBOT)
    (tmp_path / "neighbour.py").write_text('KIT = "order_0_kit_0"\n')
    (tmp_path / "broken.py").write_text("import no_such_module_of_mine\n")
    (tmp_path / "quits.py").write_text("import sys\nsys.exit('no ROS here')\n")
    (tmp_path / "wrong.py").write_text("def (:\n")
    monkeypatch.setattr("sys.path", [entry for entry in __import__("sys").path if entry not in ("", str(tmp_path))])
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_find_agent_by_bundled_name_constructs_it() -> None:
    agent = find_agent("lesson")()
    assert isinstance(agent, LessonAgent)
    assert isinstance(agent, Agent)


@pytest.mark.parametrize(
    "name", ["my_robot.py:Robot", "./my_robot.py:Robot", "my_robot:Robot", "{folder}/my_robot.py:Robot"]
)
def test_find_agent_in_user_file_or_module_runs_it(folder: Path, name: str) -> None:
    make = find_agent(name.format(folder=folder))
    assert make() is not make()
    result = run_cell(Cell(KITTING), make())
    assert (result.outcome, result.score.total) == (Outcome.DONE, 6.0)


def test_find_agent_in_installed_package_constructs_it() -> None:
    assert isinstance(find_agent("cellwright.clients.agents.lesson:LessonAgent")(), LessonAgent)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("leson", "unknown agent 'leson'; did you mean lesson .*your own is given as path.py:Class or module:Class"),
        ("", "unknown agent ''"),
        ("my_robot.py", "your own is given as path.py:Class"),
        ("my_robot.py:", "unknown agent 'my_robot.py:'"),
        (":Robot", "unknown agent ':Robot'"),
        ("nowhere.py:Robot", "nowhere.py: there is no such file"),
        (f"{'n' * 300}.py:Robot", "n.py: there is no such file"),
        ("nowhere:Robot", "nowhere: cannot be imported: ModuleNotFoundError: No module named 'nowhere'"),
        ("my_robot.py:Robto", "unknown class 'Robto'; did you mean Robot"),
        ("my_robot.py:NoAgent", "an agent is a class with a method run"),
        ("my_robot.py:run_fast", "an agent is a class with a method run"),
        ("my_robot.py:NUMBER", "an agent is a class with a method run"),
        ("my_robot.py:Async", "run.client. must be a plain method .got async"),
        ("my_robot.py:Stepwise", "run.client. must be a plain method .got async"),
        ("broken.py:Robot", "broken.py:1: cannot be imported: ModuleNotFoundError: .*no_such_module_of_mine"),
        ("quits.py:Robot", "quits.py:2: cannot be imported: SystemExit: no ROS here"),
        ("quits:Robot", "quits: cannot be imported: SystemExit: no ROS here"),
        ("wrong.py:Robot", "wrong.py:1: cannot be imported: SyntaxError"),
    ],
)
def test_find_agent_with_bad_name_is_refused_with_reason(folder: Path, name: str, reason: str) -> None:
    with pytest.raises(AgentError, match=reason):
        find_agent(name)


def test_failed_construction_of_agent_is_reported(folder: Path) -> None:
    make = find_agent("my_robot.py:WithArgument")
    with pytest.raises(AgentError, match=r"my_robot.py:WithArgument: cannot be made: TypeError: .*tool"):
        make()
    with pytest.raises(AgentError, match=r"my_robot.py:Failing: cannot be made: Unprintable: no reason given"):
        find_agent("my_robot.py:Failing")()
