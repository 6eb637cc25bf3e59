"""Run log: the run's settings, the referee's actions with their times, evidence at each submission, and the result.

Lines of JSON, each with its `kind`, and its simulation `time` [s] where it has one:

- `run`: trial, seed, versions and so on, the attainable score, and what the caller adds;
- `state`, `conveyor`, `population`, `order`, `kit`, `order complete`, `trial over`: actions of the referee;
- `collision`: a finished collision of a link of an arm or a robot, the `owner`; `link`, `obstacle`, `begin`, `end` [s],
  and `deviation` [m], the largest distance of the arm's tool from its setpoint;
- `reset`: the simulation was reset at that time; times after it count from 0 again;
- `result`: outcome, score with all its evidence, state hash. A log without it is of a run that was killed.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cellwright.cell.kitting import effects
from cellwright.cell.kitting.attainable import AttainableScore, attainable_score
from cellwright.cell.kitting.evidence import Evidence, evidence_to_json, kit_evidence, kit_to_json
from cellwright.cell.kitting.scorer import system_cost
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import seconds
from cellwright.util.files import JsonLines

FORMAT = 1
"""Format number, in the first line."""


class RunEvents:
    """Events of one run, as the values of the lines of its log.

    Args:
        write: called with each line.
        about: values that the caller adds to the first line, such as the agent's name.
    """

    def __init__(self, write: Callable[[Mapping[str, Any]], None], about: Mapping[str, Any] | None = None) -> None:
        self._write = write
        self._about = dict(about or {})
        self._reach = AttainableScore(())

    def begin(self, trial: Trial, more: Mapping[str, Any]) -> None:
        """Write the first line; `more` is seed, versions and the like."""
        self._reach = attainable_score(trial)
        facts = {
            "best": self._reach.maximum,
            "reachable": self._reach.total,
            "reachable_reason": self._reach.sentence(),
            "system_cost": system_cost(trial.sensors),
            "circumstances": asdict(trial.circumstances),
            "overrides": list(trial.overrides),
        }
        self._write({"kind": "run", "format": FORMAT, "trial": trial.name, **more, **self._about, **facts})

    def effect(self, effect: effects.Effect, now: int) -> None:
        """Write an action of the referee at the time `now` [ns]."""
        kind, values = _values(effect, self._reach)
        self._write({"kind": kind, "time": seconds(now), **values})

    def collision(self, facts: Mapping[str, Any]) -> None:
        """Write a finished collision of an arm or a robot, with the fields of `run.collisions.Collision`."""
        self._write({"kind": "collision", "time": facts["end"], **facts})

    def end(self, outcome: str, evidence: Evidence, now: int, more: Mapping[str, Any]) -> None:
        """Write the result at the time `now` [ns]; `more` is state hash, wall time and the like."""
        score = evidence_to_json(evidence)
        self._write({"kind": "result", "time": seconds(now), "outcome": outcome, **more, "score": score})


class RunLog(RunEvents):
    """Log file of one run.

    Args:
        path: the file; an existing one is overwritten.
        about: see `RunEvents`.
        report: called with a line when the disk fails; the run goes on without its log.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(
        self, path: Path, *, about: Mapping[str, Any] | None = None, report: Callable[[str], None] = lambda _line: None
    ) -> None:
        self.lines = JsonLines(path, report=report)
        super().__init__(self.lines.write_value, about)

    def reset(self, now: int) -> None:
        """Write that the simulation was reset at the time `now` [ns]."""
        self.lines.write_value({"kind": "reset", "time": seconds(now)})


def _values(effect: effects.Effect, attainable: AttainableScore) -> tuple[str, dict[str, Any]]:
    match effect:
        case effects.StateChanged(state):
            return "state", {"state": str(state)}
        case effects.ConveyorPower(power):
            return "conveyor", {"power": power}
        case effects.PopulationRestart():
            return "population", {"action": "restart"}
        case effects.OrderAnnounced(order, reason, interrupts):
            kits = {kit.kit_type: [each.type for each in kit.objects] for kit in order.kits}
            return "order", {"order_id": order.order_id, "reason": str(reason), "interrupts": interrupts, "kits": kits}
        case effects.KitSubmitted():
            return "kit", _submission(effect, attainable)
        case effects.OrderCompleted(score, resumes):
            return "order complete", {
                "order_id": score.order_id,
                "total": score.total,
                "time_taken": seconds(score.time_taken),
                "resumes": resumes,
            }
        case effects.TrialEnded(reason, game, process_time):
            return "trial over", {"reason": str(reason), "total": game.total, "process_time": seconds(process_time)}


def _submission(effect: effects.KitSubmitted, attainable: AttainableScore) -> dict[str, Any]:
    score = effect.score
    values = {"tray_id": effect.tray_id, "kit_type": effect.kit_type, "repeated": effect.is_repeated}
    if score.refusal is not None:
        return {**values, "refusal": score.refusal.sentence(), "evidence": None}
    evidence = kit_evidence(score, attainable.kit(score.kit_type), fates=effect.fates)
    return {**values, "refusal": None, "evidence": kit_to_json(evidence)}
