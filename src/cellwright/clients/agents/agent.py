"""The agent interface, and discovery of agents by name."""

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Protocol, runtime_checkable

from cellwright.clients.client.client import Client
from cellwright.clients.policies.policy import PolicyError
from cellwright.clients.policies.spec import is_policy
from cellwright.util import plugins
from cellwright.util.errors import CellwrightError, UnknownNameError, UsageError

BUNDLED = {
    "kitter": "cellwright.clients.agents.kitter.agent:KitterAgent",
    "lesson": "cellwright.clients.agents.lesson:LessonAgent",
    "operator": "cellwright.clients.agents.operator.agent:OperatorAgent",
}
"""Agents bundled with Cellwright, by name."""

OPERATOR = "operator"
"""Name of the bundled agent that lets a person work the cell."""

REPLAY = "replay:"
"""Begin of the name of an agent that sends the commands of a recording again; its path follows."""
_REPLAY_AGENT = "cellwright.recording.replay.recorded_agent:RecordedAgent"
"""It reads recordings, which this room does not know; it is loaded for such a name alone."""


@runtime_checkable
class Agent(Protocol):
    """A program that works a cell; it is constructed without arguments and run once.

    Example:
        >>> from cellwright import Cell, Trial, run_cell
        >>> class StartAndWait:
        ...     def run(self, client):
        ...         client.start_competition()
        ...         client.sleep(1.0)
        >>> run_cell(Cell(Trial("empty")), StartAndWait()).simulated
        1.0
    """

    def run(self, client: Client) -> None:
        """Work the cell; return when done.

        Args:
            client: client of the cell. The run ends when this method returns; an exception ends it as failed.
        """


class AgentError(CellwrightError):
    """No such agent, or its construction failed."""


def find_agent(name: str) -> Callable[[], Agent]:
    """Return a factory for an agent: a name, `path/to/file.py:Class`, `package.module:Class`, or `replay:run.mcap`.

    `policy` is followed by the words of a command line (`cellwright.clients.policies.spec`). Bundled agents are looked
    up by name first, then those of other packages (`cellwright.util.plugins`).

    Raises:
        PluginError: another package has an agent of this name that cannot be imported.
        AgentError: there is no such file, module or class, or its import fails. The factory raises it too, when it
            cannot construct the agent.
    """
    if name not in BUNDLED and not is_policy(name) and ":" not in name and name in plugins.names("agents"):
        return maker_of(f"agent {name}", plugins.load("agents", name))
    if is_policy(name):
        return _policy_maker(name)
    if name.startswith(REPLAY):
        return partial(_make_replay, Path(name.removeprefix(REPLAY)))
    target = BUNDLED.get(name, name)
    if not plugins.is_class_path(target):
        reason = UnknownNameError("agent", name, [*BUNDLED, *plugins.names("agents")]).sentence()
        raise AgentError(f"{reason}; your own is given as path.py:Class or module:Class")
    return maker_of(target, plugins.find_class(target, method="run", error=AgentError))


def _policy_maker(words: str) -> Callable[[], Agent]:
    """Return the factory for a policy by the words of a command line."""
    from cellwright.clients.policies.program import policy_agent  # it loads the wires

    try:
        return policy_agent(words)
    except (PolicyError, UsageError) as error:
        raise AgentError(str(error)) from None


def _make_replay(path: Path) -> Agent:
    try:
        found: Agent = plugins.find_class(_REPLAY_AGENT, method="run", error=AgentError)(path)
    except UsageError as error:
        raise AgentError(f"{REPLAY}{error}") from error
    return found


def maker_of(target: str, found: object) -> Callable[[], Agent]:
    """Return a factory for a class that its author calls `target`; errors as of `find_agent`."""
    if not callable(found) or not hasattr(found, "run"):
        raise AgentError(f"{target}: an agent is a class with a method run(client)")
    run = found.run
    if inspect.iscoroutinefunction(run) or inspect.isgeneratorfunction(run) or inspect.isasyncgenfunction(run):
        # called, it would silently do nothing
        raise AgentError(
            f"{target}: run(client) must be a plain method (got async or a generator); remove async and yield"
        )
    return plugins.make_factory(target, found, AgentError)
