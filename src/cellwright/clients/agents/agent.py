"""What an agent is, and where one is found."""

import inspect
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from cellwright.clients.client.client import Client
from cellwright.util import plugins
from cellwright.util.errors import CellwrightError, UnknownNameError


@runtime_checkable
class Agent(Protocol):
    """A program that works a cell: made without arguments, run once."""

    def run(self, client: Client) -> None:
        """Work the cell. Returning means having done what it came for."""


BUNDLED = {
    "kitter": "cellwright.clients.agents.kitter.agent:KitterAgent",
    "lesson": "cellwright.clients.agents.lesson:LessonAgent",
}
"""Agents that come with Cellwright, by name."""


class AgentError(CellwrightError):
    """An agent that cannot be found or made."""


def find_agent(name: str) -> Callable[[], Agent]:
    """What makes an agent: a name, `path/to/file.py:Class`, or `package.module:Class`.

    Names are those of agents that come along, and then those that other packages bring
    (`cellwright.util.plugins`).

    Raises:
        PluginError: another package brings an agent of this name along, and it cannot be imported.
        AgentError: there is no such file, module or class, or it fails when it is imported. Making the agent raises
            it too, when that fails.
    """
    if name not in BUNDLED and ":" not in name and name in plugins.names("agents"):
        return maker_of(f"agent {name}", plugins.load("agents", name))
    target = BUNDLED.get(name, name)
    if not plugins.is_class_path(target):
        reason = UnknownNameError("agent", name, [*BUNDLED, *plugins.names("agents")]).sentence()
        raise AgentError(f"{reason}; your own is given as path.py:Class or module:Class")
    return maker_of(target, plugins.find_class(target, method="run", error=AgentError))


def maker_of(target: str, found: object) -> Callable[[], Agent]:
    """What makes an agent of a class that its author calls `target`; errors as of `find_agent`."""
    if not callable(found) or not hasattr(found, "run"):
        raise AgentError(f"{target}: an agent is a class with a method run(client)")
    run = found.run
    if inspect.iscoroutinefunction(run) or inspect.isgeneratorfunction(run) or inspect.isasyncgenfunction(run):
        # called, it would do nothing and say nothing
        raise AgentError(f"{target}: its run(client) must be a plain method, without async or yield")
    return plugins.maker(target, found, AgentError)
