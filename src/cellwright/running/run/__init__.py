"""Session of a cell, a robot or a recording, from start to result."""

from cellwright.running.run.agent_work import DRIVE, agent_traceback, call_agent, wait_for_kits
from cellwright.running.run.headless import run_cell, run_trial
from cellwright.running.run.options import GRACE, PageOptions, RecordOptions, RunOptions, ServerOptions
from cellwright.running.run.result import Outcome, RunResult, SessionResult, final_outcome, versions
from cellwright.running.run.session import Program, Session
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
