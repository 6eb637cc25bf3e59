"""Headless runs of a cell or a trial in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.cell.checks.findings import cell_warnings
from cellwright.cell.variation import vary
from cellwright.clients.agents.agent import Agent
from cellwright.config.arm import ServoProfile
from cellwright.config.parsing.overrides import Override
from cellwright.config.trial import gear2017
from cellwright.config.trial.joining import TrialName, find_files
from cellwright.config.trial.trial import Trial
from cellwright.running.run.cells import CellTarget
from cellwright.running.run.loading import warn_of
from cellwright.running.run.options import RecordOptions, RunOptions
from cellwright.running.run.result import RunResult, cell_result
from cellwright.running.run.session import Session
from cellwright.util.errors import UsageError


def run_cell(
    cell: Cell,
    agent: Agent | None,
    options: RunOptions | None = None,
    *,
    record: str | Path | Sequence[str | Path] | RecordOptions | None = None,
) -> RunResult:
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
        record: files to write of the run, as for `Session`.

    Returns:
        The result; it holds what the agent raises.

    Raises:
        UsageError: there is neither an agent nor a time to stop at.
        UnknownNameError: a topic to listen to does not exist.
        CheckpointError: the checkpoint to start from cannot be read, or is of another cell.
    """
    with Session(cell, record=record, options=options) as session:
        return cell_result(session.run(agent))


def run_trial(
    trial: Trial | TrialName,
    agent: Agent | type[Agent] | str | None = "kitter",
    *,
    seed: int | None = None,
    record: str | Path | Sequence[str | Path] | None = None,
    options: RunOptions | None = None,
) -> RunResult:
    """Run a trial headless, as fast as it goes, until it is over.

    Example:
        >>> import cellwright
        >>> result = cellwright.run_trial("lesson", None, options=cellwright.RunOptions(until=0.1))
        >>> result.outcome.name, result.steps
        ('UNTIL', 50)

    Args:
        trial: the trial, its name, or the path of its file; several are joined, as in
            `"final01+kitter_sensors"` or a list.
        agent: works the cell: an object with a method `run(client)` or its class, the name of a bundled agent, or
            `"path.py:Class"`. None for no agent; `options` then holds the time to stop at.
        seed: seed of all random streams; None takes the trial's own.
        record: files to write of the run, as for `Session`, such as `run.mcap`. The recording of a trial that is given
            by name holds its files too, and can be run again from that alone.
        options: further options of the run.

    Returns:
        The result; it holds what the agent raises.

    Raises:
        UnknownNameError: there is no such trial.
        DescriptionError: the trial's file is not valid.
        AgentError: there is no such agent, or it cannot be made. The result holds what it raises at work.
        UsageError: there is neither an agent nor a time to stop at.
    """
    return CellOfTrial(trial, seed).run(agent, record, options)


@dataclass(frozen=True)
class CellOfTrial:
    """Cell of a trial, and how it differs from the trial's files.

    Example:
        >>> CellOfTrial("lesson", overrides=("time_limit=60",)).make().trial.time_limit
        60.0

    Attributes:
        trial: the trial, its name, or the path of its file; several are joined.
        seed: seed of all random streams; None takes the trial's own.
        is_varied: True if the seed varies the trial.
        overrides: values that replace those of the files, as `KEY=VALUE`.
        servo: servo profile of the arm; None takes the file's.
    """

    trial: Trial | TrialName
    seed: int | None = None
    is_varied: bool = False
    overrides: Sequence[str] = ()
    servo: ServoProfile | None = None

    def make(self, on_warning: Callable[[object], None] = lambda _warning: None) -> Cell:
        """Return a new cell; `on_warning` receives the warnings for the files' author.

        Raises:
            DescriptionError: the trial's file is not valid.
            UsageError: an override is not KEY=VALUE, or the trial is an object, which takes none.
        """
        trial = self.trial
        if not isinstance(trial, Trial):
            loaded = gear2017.load_trial(find_files(trial), overrides=list(map(Override.read, self.overrides)))
            for warning in (*loaded.warnings, *cell_warnings(loaded.trial, loaded.places)):
                on_warning(warning)
            trial = loaded.trial
        elif self.overrides:
            raise UsageError(
                f"{self.overrides[0]}: a trial that is an object takes no overrides; give its name or file"
            )
        if self.is_varied:
            trial = vary(trial, trial.settings.seed if self.seed is None else self.seed)
        return Cell(trial, seed=self.seed, servo=self.servo)

    def run(
        self,
        agent: Agent | type[Agent] | str | None,
        record: str | Path | Sequence[str | Path] | None = None,
        options: RunOptions | None = None,
    ) -> RunResult:
        """Run the trial headless; see `run_trial`."""
        files = [] if isinstance(self.trial, Trial) else find_files(self.trial)
        lines: list[object] = []
        target = CellTarget(lambda: self.make(lines.append), lambda: files, is_varied=self.is_varied)
        recorded = replace(RecordOptions.of(record or ()), about={"agent": _name_of(agent)})
        with Session(target, record=recorded, options=options) as session:
            warn_of(lines, 4)
            return cell_result(session.run(agent))


def _name_of(agent: Agent | type[Agent] | str | None) -> str:
    """Return the name of an agent for a recording."""
    if agent is None or isinstance(agent, str):
        return agent or "none"
    return agent.__qualname__ if isinstance(agent, type) else type(agent).__qualname__
