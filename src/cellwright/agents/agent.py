"""What an agent is, and where one is found."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, runtime_checkable

from cellwright import plugins
from cellwright.client.client import Client
from cellwright.errors import CellwrightError, UnknownNameError


@runtime_checkable
class Agent(Protocol):
    """A program that works a cell: made without arguments, run once."""

    def run(self, client: Client) -> None:
        """Work the cell. Returning means having done what it came for."""


BUNDLED = {
    "kitter": "cellwright.agents.kitter.agent:KitterAgent",
    "lesson": "cellwright.agents.lesson:LessonAgent",
}
"""Agents that come with Cellwright, by name."""


class AgentError(CellwrightError):
    """An agent that cannot be found or made."""


def find_agent(name: str) -> Callable[[], Agent]:
    """What makes an agent: a name, `path/to/file.py:Class`, or `package.module:Class`.

    Names are those of agents that come along, and then those that other packages bring (`cellwright.plugins`).

    Raises:
        PluginError: another package brings an agent of this name along, and it cannot be imported.
        AgentError: there is no such file, module or class, or it fails when it is imported. Making the agent raises
            it too, when that fails.
    """
    if name not in BUNDLED and ":" not in name and name in plugins.names("agents"):
        return _maker(f"agent {name}", plugins.load("agents", name))
    target = BUNDLED.get(name, name)
    place, colon, class_name = target.rpartition(":")
    if not colon or not place or not class_name:
        reason = UnknownNameError("agent", name, [*BUNDLED, *plugins.names("agents")]).sentence()
        raise AgentError(f"{reason}; your own is given as path.py:Class or module:Class")
    module = _import_file(Path(place)) if place.endswith(".py") else _import_module(place)
    try:
        found = getattr(module, class_name)
    except AttributeError:
        classes = [key for key, value in vars(module).items() if isinstance(value, type) and hasattr(value, "run")]
        raise AgentError(f"{place}: {UnknownNameError('class', class_name, classes).sentence()}") from None
    return _maker(target, found)


def _maker(target: str, found: object) -> Callable[[], Agent]:
    """What makes an agent of a class."""
    if not callable(found) or not hasattr(found, "run"):
        raise AgentError(f"{target}: an agent is a class with a method run(client)")

    def make() -> Agent:
        try:
            agent: Agent = found()
        except (Exception, SystemExit) as error:
            raise AgentError(f"{target}: cannot be made: {_reason(error)}") from error
        return agent

    return make


def _import_module(name: str) -> object:
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)  # an installed command does not look into the folder that it is called in
    try:
        return importlib.import_module(name)
    except (Exception, SystemExit) as error:
        raise AgentError(f"{name}: cannot be imported: {_reason(error)}") from error


def _import_file(path: Path) -> object:
    if not path.is_file():
        raise AgentError(f"{path}: there is no such file")
    name = f"cellwright_agent_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise AgentError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickling look modules up by name
    sys.path.insert(0, str(path.parent.resolve()))  # so that it can import its neighbours
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise AgentError(f"{path}{_line(path, error)}: cannot be imported: {_reason(error)}") from error
    return module


def _reason(error: BaseException) -> str:
    """The error in one line."""
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {' '.join(text.split())}"


def _line(path: Path, error: BaseException) -> str:
    """`:` and the line of the file that led to the error; nothing when it is not known."""
    frames = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError):
        frames.append((error.filename or "", error.lineno))
    lines = [line for name, line in frames if Path(name).resolve() == path.resolve()]
    return f":{lines[-1]}" if lines else ""
