"""The result of a run as programs read it: JSON values in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from cellwright.cell import Cell
from cellwright.kitting.score_document import of_score
from cellwright.run import RunResult, versions


def of_run(cell: Cell, agent: str, result: RunResult, status: int, pictures: Sequence[str]) -> dict[str, Any]:
    """A run's result; times in s."""
    return {
        "trial": cell.trial.name,
        "agent": agent,
        "seed": cell.seed,
        "servo": cell.servo,
        "timestep": float(Fraction(*cell.trial.settings.timestep)),
        "outcome": result.outcome.name.lower(),
        "exit_status": status,
        "error": result.error,
        "competition_state": result.competition_state,
        "simulated": result.simulated,
        "wall": result.wall,
        "real_time_factor": result.real_time_factor,
        "steps": result.steps,
        "state_hash": result.state_hash,
        "score": of_score(result.score, cell.trial),
        "heard": result.heard,
        "refused": dict(cell.bus.refusals.counts),
        "pictures": list(pictures),
        "versions": versions(),
    }
