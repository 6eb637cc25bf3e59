"""`cellwright run --over`: a cell whose agent works in a process of its own."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from contextlib import ExitStack

from cellwright.cell.cell import Cell
from cellwright.cli.run.attended import Attended
from cellwright.cli.signals import stopped_by_signals
from cellwright.middleware.ros1.host import Ros1
from cellwright.running.remote.hosting import Host
from cellwright.running.run import RunOptions, RunResult

Report = Callable[[str], None]


def hosted(
    cell: Cell,
    agent: str,
    wanted: RunOptions,
    *,
    way: str,
    lockstep: bool,
    verbose: bool,
    report: Report,
    attended: Attended | None = None,
) -> RunResult:
    """Run a cell whose agent works in a process of its own.

    Args:
        cell: the cell.
        agent: the agent's name.
        wanted: what the run is told besides.
        way: how the agent comes to the cell, one of `over.WAYS`.
        lockstep: whether time passes only while the agent waits.
        verbose: whether to tell what the agent logs at level INFO.
        report: takes a line about what goes wrong in ROS.
        attended: who looks on; None for nobody.
    """
    host = Host(cell, agent, lockstep=lockstep, level=logging.INFO if verbose else logging.WARNING, say=_say)
    if attended is not None:
        host.server, host.tempo = attended.server, attended.tempo
    with stopped_by_signals(host.interrupt), ExitStack() as to_close:
        if way == "ros1":
            host.ros = to_close.enter_context(Ros1(report, lambda: host.is_interrupted))
            host.ros.prepare()
        return host.run(wanted)


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
