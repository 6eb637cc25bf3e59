"""Fixtures of the command line, which runs in this process in an empty folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cli.main import main
from cellwright.rendering.picture import render
from cellwright.running.run.observers import Pictures


@dataclass(frozen=True)
class Ran:
    """Output and exit status of a command."""

    status: int
    out: str
    err: str


CommandLine = Callable[..., Ran]


@pytest.fixture
def cellwright(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> Ran:
        capsys.readouterr()
        status = main(arguments)
        out, err = capsys.readouterr()
        return Ran(status, out, err)

    return run


@pytest.fixture
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shrink the pictures of a run, and draw them here: a process for each takes a second."""

    def small(model: Any, data: Any, camera: Any, *_size: tuple[int, int], **more: Any) -> NDArray[np.uint8]:
        return render(model, data, camera, (64, 36), **more)

    monkeypatch.setattr("cellwright.robot.pictures.render", small)
    monkeypatch.setattr("cellwright.running.run.observers.render", small)
    monkeypatch.setattr(Pictures, "_draw", Pictures._draw_by_rays)


AGENTS = """
import sys

class Ends:
    def run(self, client):
        print("something that the agent prints")
        client.start_competition()
        client.sleep(0.5)
        client.end_competition()

class GivesUp:
    def run(self, client):
        client.start_competition()
        client.sleep(0.1)

class Waits:
    def run(self, client):
        client.start_competition()
        client.wait_until(lambda: False)

class Crashes:
    def run(self, client):
        raise ValueError("no idea")

class Exits:
    def run(self, client):
        sys.exit(3)

class ExitsWell:
    def run(self, client):
        client.end_competition()
        client.sleep(0.1)
        sys.exit()

class CannotBeMade:
    def __init__(self, name):
        pass

    def run(self, client):
        pass

class NoAgent:
    pass
"""


@pytest.fixture
def agents(tmp_path: Path) -> str:
    """Return the name of a file with agents, in the folder of the commands."""
    (tmp_path / "agents.py").write_text(AGENTS)
    return "agents.py"
