"""Session of a cell, a robot or a recording, from start to result."""

from cellwright.running.run.agent_work import DRIVE, POLICY_FAULTS, agent_traceback, call_agent, wait_for_kits
from cellwright.running.run.cells import CellTarget
from cellwright.running.run.headless import run_cell, run_trial
from cellwright.running.run.loading import DescriptionWarning, load_robot, load_trial
from cellwright.running.run.options import (
    GRACE,
    Outputs,
    PageOptions,
    RecordOptions,
    RunOptions,
    ServerOptions,
    WorldOptions,
)
from cellwright.running.run.result import Outcome, RunResult, SessionResult, cell_result, final_outcome, versions
from cellwright.running.run.session import Program, Session

__all__ = [
    "DRIVE",
    "GRACE",
    "POLICY_FAULTS",
    "CellTarget",
    "DescriptionWarning",
    "Outcome",
    "Outputs",
    "PageOptions",
    "Program",
    "RecordOptions",
    "RunOptions",
    "RunResult",
    "ServerOptions",
    "Session",
    "SessionResult",
    "WorldOptions",
    "agent_traceback",
    "call_agent",
    "cell_result",
    "final_outcome",
    "load_robot",
    "load_trial",
    "run_cell",
    "run_trial",
    "versions",
    "wait_for_kits",
]
