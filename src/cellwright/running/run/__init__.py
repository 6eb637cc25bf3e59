"""One run from start to result."""

from cellwright.running.run.course import DRIVE, Course, how_it_ended, wait_for_kits
from cellwright.running.run.options import RunOptions
from cellwright.running.run.record import RecordOptions
from cellwright.running.run.result import Outcome, RunResult, versions
from cellwright.running.run.run import GRACE, conduct, run_cell
from cellwright.running.run.working import let_work, told, work_in_process

__all__ = [
    "DRIVE",
    "GRACE",
    "Course",
    "Outcome",
    "RecordOptions",
    "RunOptions",
    "RunResult",
    "conduct",
    "how_it_ended",
    "let_work",
    "run_cell",
    "told",
    "versions",
    "wait_for_kits",
    "work_in_process",
]
