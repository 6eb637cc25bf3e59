"""Session of a cell, a robot or a recording, from start to result."""

from cellwright.running.run.options import GRACE, PageOptions, RecordOptions, RunOptions, ServerOptions
from cellwright.running.run.result import Outcome, RunResult, SessionResult, final_outcome, versions
from cellwright.running.run.session import (
    DRIVE,
    Program,
    Session,
    agent_traceback,
    call_agent,
    run_cell,
    run_trial,
    wait_for_kits,
)
from cellwright.running.run.targets import CellTarget, DescriptionWarning, load_robot, load_trial

__all__ = [
    "DRIVE",
    "GRACE",
    "CellTarget",
    "DescriptionWarning",
    "Outcome",
    "PageOptions",
    "Program",
    "RecordOptions",
    "RunOptions",
    "RunResult",
    "ServerOptions",
    "Session",
    "SessionResult",
    "agent_traceback",
    "call_agent",
    "final_outcome",
    "load_robot",
    "load_trial",
    "run_cell",
    "run_trial",
    "versions",
    "wait_for_kits",
]
