"""Headless runs of a cell or a trial in one call."""

from __future__ import annotations

from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent
from cellwright.config.trial import gear2017
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.trial import Trial
from cellwright.running.run.options import RecordOptions, RunOptions
from cellwright.running.run.result import RunResult
from cellwright.running.run.session import Session, warn_at_runtime
from cellwright.running.run.targets import CellTarget, cell_result, warn_of


def run_cell(cell: Cell, agent: Agent | None, options: RunOptions | None = None) -> RunResult:
    """Run a cell from the start until it is over.

    Example:
        >>> import cellwright
        >>> cell = cellwright.Cell(cellwright.load_trial("lesson"))
        >>> cellwright.run_cell(cell, None, cellwright.RunOptions(until=0.1)).steps
        50

    Args:
        cell: the cell; it is reset to time 0.
        agent: works the cell; None for no agent: the run lasts until `options.until`.
        options: further options of the run.

    Returns:
        The result; it holds what the agent raises.

    Raises:
        UsageError: there is neither an agent nor a time to stop at.
        UnknownNameError: a topic to listen to does not exist.
        CheckpointError: the checkpoint to start from cannot be read, or is of another cell.
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

    Example:
        >>> import cellwright
        >>> result = cellwright.run_trial("lesson", None, options=cellwright.RunOptions(until=0.1))
        >>> result.outcome.name, result.steps
        ('UNTIL', 50)

    Args:
        trial: the trial, its name, or the path of its file.
        agent: works the cell: an object with a method `run(client)` or its class, the name of a bundled agent, or
            `"path.py:Class"`. None for no agent; `options` then holds the time to stop at.
        seed: seed of all random streams; None takes the trial's own.
        record: a file to record the run to, such as `run.mcap`. The recording of a trial that is given by name holds
            its files too, and can be run again from that alone.
        options: further options of the run.

    Returns:
        The result; it holds what the agent raises.

    Raises:
        UnknownNameError: there is no such trial.
        DescriptionError: the trial's file is not valid.
        AgentError: there is no such agent, or it cannot be made. The result holds what it raises at work.
        UsageError: there is neither an agent nor a time to stop at.
    """
    path = None if isinstance(trial, Trial) else find_trial(trial)
    lines: list[object] = []

    def make() -> Cell:
        if isinstance(trial, Trial):
            return Cell(trial, seed=seed)
        loaded = gear2017.load_trial([find_trial(trial)])
        lines.extend(loaded.warnings)
        return Cell(loaded.trial, seed=seed)

    recorded = (
        None if record is None else RecordOptions([Path(record)], {"agent": _name_of(agent)}, report=warn_at_runtime)
    )
    target = CellTarget(make, lambda: [] if path is None else [path])
    with Session(target, record=recorded, options=options) as session:
        warn_of(lines, 3)
        return cell_result(session.run(agent))


def _name_of(agent: Agent | type[Agent] | str | None) -> str:
    """Return the name of an agent for a recording."""
    if agent is None or isinstance(agent, str):
        return agent or "none"
    return agent.__qualname__ if isinstance(agent, type) else type(agent).__qualname__
