"""What came of a run, and what that depends on."""

from __future__ import annotations

import platform
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import mujoco
import numpy as np

import cellwright
from cellwright.cell.kitting.score.evidence import Evidence
from cellwright.cell.kitting.score.scorer import GameScore
from cellwright.running.run.collisions import Collision


class Outcome(StrEnum):
    """How a run ended."""

    DONE = "done"
    TIME_LIMIT = "time limit"
    GAVE_UP = "the agent ended before the orders were complete"
    CRASHED = "the agent crashed"
    UNSTABLE = "the simulation became unstable"
    UNTIL = "stopped before the competition was done"
    INTERRUPTED = "interrupted"


@dataclass
class RunResult:
    """What came of a run. Times in seconds."""

    outcome: Outcome
    competition_state: str
    score: GameScore
    evidence: Evidence
    state_hash: str
    simulated: float
    wall: float
    steps: int
    error: str = ""
    heard: dict[str, int] = field(default_factory=dict)
    collisions: list[Collision] = field(default_factory=list)
    """What links of the arm hit."""
    recordings: list[Path] = field(default_factory=list)
    """The recordings that were written."""
    is_recorded: bool = True
    """Whether everything that was to be recorded is in them."""

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a wall second."""
        return self.simulated / self.wall if self.wall > 0 else 0.0


def versions() -> dict[str, str]:
    """What a result depends on besides trial, agent and seed."""
    return {
        "cellwright": cellwright.__version__,
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
    }
