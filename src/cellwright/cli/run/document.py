"""The result of a run as programs read it: JSON values in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.score.evidence import Evidence
from cellwright.cell.kitting.score.evidence_json import evidence_to_json, trial_score_to_json
from cellwright.cell.kitting.score.trial_score import TrialScore
from cellwright.running.run import RunResult, versions

if TYPE_CHECKING:
    from cellwright.running.serving import Pace


def of_run(
    cell: Cell, agent: str, result: RunResult, status: int, pictures: Sequence[str], final: TrialScore | None = None
) -> dict[str, Any]:
    """A run's result; times in s.

    Args:
        cell: the cell that ran.
        agent: the name of what worked it.
        result: what came of it.
        status: exit status of the command.
        pictures: files of pictures that were written.
        final: the score of the trial as in the finals, if averages are known.
    """
    return {
        "trial": cell.trial.name,
        "agent": agent,
        "seed": cell.seed,
        "servo": cell.servo,
        "circumstances": asdict(cell.trial.circumstances),
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
        "score": of_score(result.evidence, final),
        "collisions": [asdict(collision) for collision in result.collisions],
        "heard": result.heard,
        "refused": dict(cell.bus.refusals.counts),
        "pictures": list(pictures),
        "recordings": [str(path) for path in result.recordings],
        "versions": versions(),
    }


def of_pace(pace: Pace | None) -> dict[str, float] | None:
    """How time kept to the wall clock; lateness in s."""
    return None if pace is None else asdict(pace)


def of_score(found: Evidence, final: TrialScore | None = None) -> dict[str, Any]:
    """A run's score with its evidence, and the score of the trial as in the finals if averages are known."""
    return evidence_to_json(found) | {"trial_score": None if final is None else trial_score_to_json(final)}
