"""One run from start to result."""

from cellwright.running.run.record import RecordOptions
from cellwright.running.run.result import Outcome, RunResult, versions
from cellwright.running.run.run import GRACE, RunOptions, execute_run, run_cell
from cellwright.running.run.work import (
    DRIVE,
    RunContext,
    agent_traceback,
    call_agent,
    how_it_ended,
    wait_for_kits,
    work_in_process,
)

__all__ = [
    "DRIVE",
    "GRACE",
    "Outcome",
    "RecordOptions",
    "RunContext",
    "RunOptions",
    "RunResult",
    "agent_traceback",
    "call_agent",
    "execute_run",
    "how_it_ended",
    "run_cell",
    "versions",
    "wait_for_kits",
    "work_in_process",
]
