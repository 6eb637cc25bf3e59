"""The short way to a cell, a robot and a run, by their names: what `import cellwright` shows first."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent, find_agent, maker_of
from cellwright.config.parsing.sources import sources_collected
from cellwright.config.robot import robots
from cellwright.config.robot.config import RobotConfig
from cellwright.config.trial import gear2017
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.trial import Trial
from cellwright.running.run import RecordOptions, RunOptions, RunResult, run_cell


class DescriptionWarning(UserWarning):
    """Something in a file that its author should know, `path:line: key: what`, and that stops nothing."""


def load_trial(*sources: str | Path, text: str | None = None) -> Trial:
    """A trial by its name or its files, or from a text. What a file's author should know is a `DescriptionWarning`.

    Args:
        sources: a trial that comes along (`"lesson"`) or the path of a YAML file; of several the texts are joined.
        text: the configuration itself, instead.

    Raises:
        UnknownNameError: there is no such trial or file.
        DescriptionError: the configuration cannot be used; the error lists everything that was found wrong.
        UsageError: neither a name nor a text, or both.
    """
    loaded = gear2017.load_trial([find_trial(source) for source in sources], text=text)
    _warn(loaded.warnings)
    return loaded.trial


def load_robot(name_or_path: str | Path) -> RobotConfig:
    """A robot by its name, or by its file. What the file's author should know is a `DescriptionWarning`.

    Args:
        name_or_path: a robot that comes along (`"tandem"`), a `vr_configs.yml`, a folder with one, or a URDF or xacro.

    Raises:
        UnknownNameError: there is no robot of this name.
        DescriptionError: the files cannot be used; the error lists everything that was found wrong.
    """
    lines: list[str] = []
    config = robots.load_robot(name_or_path, lines.append)
    _warn(lines)
    return config


def run_trial(
    trial: Trial | str | Path,
    agent: Agent | type[Agent] | str | None = "kitter",
    *,
    seed: int | None = None,
    record: str | Path | None = None,
    options: RunOptions | None = None,
) -> RunResult:
    """Run a trial headless, as fast as it goes, until it is over.

    Args:
        trial: the trial, its name, or the path of its file.
        agent: who works the cell: an object with a method `run(client)` or its class, the name of an agent that comes
            along, `"path.py:Class"`, or None for nobody; `options` then say until when.
        seed: root of all chance; None takes the trial's own.
        record: a file to record the run to, such as `run.mcap`. Of a trial that is named here it holds the files as
            well, and can be run again from that alone.
        options: what the run may be told besides.

    Raises:
        UnknownNameError: there is no such trial.
        DescriptionError: the trial's file cannot be used.
        AgentError: there is no such agent, or it cannot be made. What it raises at work is in the result.
        UsageError: neither an agent nor a time to stop at.
    """
    worker = _made(agent)
    kept = None if record is None else RecordOptions([Path(record)], {"agent": _said(agent)}, report=_warn_of_a_file)
    if not isinstance(trial, Trial):
        path = find_trial(trial)
        with sources_collected() as sources:
            loaded = gear2017.load_trial([path])
        _warn(loaded.warnings)
        trial = loaded.trial
        kept = kept and replace(kept, sources=sources, files=[path])
    if kept is not None:
        options = replace(options or RunOptions(), record=kept)
    return run_cell(Cell(trial, seed=seed), worker, options)


def _made(agent: Agent | type[Agent] | str | None) -> Agent | None:
    """The agent that is meant; a class is made, as the command line makes it."""
    if isinstance(agent, str):
        return find_agent(agent)()
    return maker_of(agent.__qualname__, agent)() if isinstance(agent, type) else agent


def _said(agent: Agent | type[Agent] | str | None) -> str:
    """An agent as a recording names it."""
    if agent is None or isinstance(agent, str):
        return agent or "none"
    return agent.__qualname__ if isinstance(agent, type) else type(agent).__qualname__


def _warn_of_a_file(line: str) -> None:
    warnings.warn(line, RuntimeWarning, stacklevel=2)


def _warn(lines: Iterable[object]) -> None:
    """Warn whoever called the function that calls this one."""
    for line in lines:
        warnings.warn(str(line), DescriptionWarning, stacklevel=3)
