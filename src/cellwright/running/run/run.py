"""Short ways to run a cell or a trial, from start to result."""

from __future__ import annotations

import warnings
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.running.run.options import RecordOptions, RunOptions
from cellwright.running.run.result import RunResult
from cellwright.running.run.session import Session
from cellwright.running.run.targets import CellTarget, cell_result, warn_of


def run_cell(cell: Cell, agent: Agent | None, options: RunOptions | None = None) -> RunResult:
    """Run a cell from the start until it is over; without an agent, until the time asked for.

    Raises:
        UsageError: neither an agent nor a time to stop at.
        UnknownNameError: a topic to listen to that does not exist.
        CheckpointError: the checkpoint to begin from cannot be read, or is of another cell.
    """
    with Session(cell, options=options) as session:
        return cell_result(session.run(agent))


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
    path = None if isinstance(trial, Trial) else find_trial(trial)
    lines: list[object] = []

    def make() -> Cell:
        if isinstance(trial, Trial):
            return Cell(trial, seed=seed)
        loaded = load_trial([find_trial(trial)])
        lines.extend(loaded.warnings)
        return Cell(loaded.trial, seed=seed)

    recorded = None if record is None else RecordOptions([Path(record)], {"agent": _name_of(agent)}, report=_warn)
    target = CellTarget(make, lambda: [] if path is None else [path])
    with Session(target, record=recorded, options=options) as session:
        warn_of(lines, 3)
        return cell_result(session.run(agent))


def _name_of(agent: Agent | type[Agent] | str | None) -> str:
    """An agent as a recording names it."""
    if agent is None or isinstance(agent, str):
        return agent or "none"
    return agent.__qualname__ if isinstance(agent, type) else type(agent).__qualname__


def _warn(line: str) -> None:
    warnings.warn(line, RuntimeWarning, stacklevel=2)
