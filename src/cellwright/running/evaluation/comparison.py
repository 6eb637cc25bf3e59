"""Comparison of two evaluations, paired by trial and seed."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.intervals import Interval, mean_interval
from cellwright.running.evaluation.measures import Change, changes
from cellwright.running.evaluation.result import Result, ResultError
from cellwright.running.evaluation.summary import are_same, done_interval, share_interval
from cellwright.util.errors import UsageError

SUMMARY_NAME = "summary.json"


@dataclass(frozen=True, slots=True)
class Pair:
    """Two runs of one trial with one seed, in two evaluations."""

    before: Result
    after: Result

    @property
    def difference(self) -> float:
        """Points of the second less those of the first."""
        return self.after.points - self.before.points

    @property
    def share(self) -> float:
        """The difference as a share of the reachable points."""
        return self.after.share - self.before.share

    @property
    def is_turned(self) -> bool:
        """True if points or outcome differ."""
        return self.difference != 0.0 or self.before.outcome != self.after.outcome

    def as_json(self) -> dict[str, Any]:
        """Return the pair as JSON values."""
        return {
            "trial": self.before.trial,
            "seed": self.before.seed,
            "difference": self.difference,
            "points": [self.before.points, self.after.points],
            "outcomes": [self.before.outcome, self.after.outcome],
            "reasons": [self.before.reason, self.after.reason],
        }


@dataclass(frozen=True, slots=True)
class TrialComparison:
    """Figures over the pairs of one trial, in points.

    Attributes:
        difference: mean of the second evaluation less that of the first.
        interval: 95 % interval of the difference; None for one pair, or if all pairs are the same.
        better: pairs that gained points.
        worse: pairs that lost points.
        measures: changes of time and placement, by the name of the measure.
    """

    trial: str
    pairs: int
    reachable: float
    before: float
    after: float
    difference: float
    interval: Interval | None
    better: int
    worse: int
    measures: Mapping[str, Change]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of two evaluations.

    Attributes:
        pairs: runs that both have, in the order of the first.
        unpaired: runs that one of them lacks, of the first and of the second.
    """

    pairs: tuple[Pair, ...]
    unpaired: tuple[int, int]

    @classmethod
    def of(cls, before: Sequence[Result], after: Sequence[Result]) -> Comparison:
        """Pair the results of two evaluations.

        Raises:
            UsageError: they have no run in common, or a trial that is not the same in both.
        """
        others = {_identity(result): result for result in after}
        pairs = tuple(Pair(each, others[_identity(each)]) for each in before if _identity(each) in others)
        for pair in pairs:
            if pair.before.reachable != pair.after.reachable:
                raise UsageError(
                    f"{pair.before.trial}: the attainable points differ (got {pair.before.reachable:g} and "
                    f"{pair.after.reachable:g}); evaluate both programs with the same trial"
                )
        if not pairs:
            raise UsageError("no run in common; evaluate both programs with the same trials, seeds and --vary")
        return cls(pairs, (len(before) - len(pairs), len(after) - len(pairs)))

    @property
    def difference(self) -> float:
        """Mean difference over all pairs, as a share of the reachable points."""
        return fmean(pair.share for pair in self.pairs)

    @property
    def interval(self) -> Interval | None:
        """95 % interval of the difference for other seeds; None if a trial has one pair, or if no seed matters."""
        groups = self._groups().values()
        if all(_is_one(group) for group in groups):
            return None
        return _within(mean_interval([[pair.share for pair in group] for group in groups]), 1.0)

    def is_regression(self, margin: float) -> bool:
        """Return whether the second is worse by more than a margin [share of the reachable points].

        It is if the whole interval lies beyond the margin; without an interval, if the difference does.
        """
        upper = self.difference if self.interval is None else self.interval[1]
        return upper < -margin - 1e-9

    @property
    def turned(self) -> list[Pair]:
        """Pairs whose points or outcomes differ: those that lost most come first."""
        return sorted((pair for pair in self.pairs if pair.is_turned), key=lambda pair: pair.share)

    def trials(self) -> list[TrialComparison]:
        """Return the figures of each trial."""
        return [_compare(trial, group) for trial, group in self._groups().items()]

    def as_json(self, margin: float) -> dict[str, Any]:
        """Return the comparison as JSON values; differences over trials are shares of the reachable points."""
        sides = [[pair.before for pair in self.pairs], [pair.after for pair in self.pairs]]
        return {
            "agents": [side[0].agent for side in sides],
            "pairs": len(self.pairs),
            "unpaired": list(self.unpaired),
            "shares": [fmean(result.share for result in side) for side in sides],
            "share_intervals": [share_interval(side) for side in sides],
            "done": [sum(result.is_done for result in side) for side in sides],
            "done_intervals": [done_interval(side) for side in sides],
            "difference": self.difference,
            "interval": self.interval,
            "margin": margin,
            "regression": self.is_regression(margin),
            "trials": [asdict(each) for each in self.trials()],
            "turned": [pair.as_json() for pair in self.turned],
        }

    def _groups(self) -> dict[str, list[Pair]]:
        groups: dict[str, list[Pair]] = {}
        for pair in self.pairs:
            groups.setdefault(pair.before.trial, []).append(pair)
        return groups


def _identity(result: Result) -> tuple[str, int, bool]:
    return result.trial, result.seed, result.vary


def _is_one(group: Sequence[Pair]) -> bool:
    """Return whether pairs are one alone, or one and the same: then they are no sample."""
    return len(group) == 1 or (are_same([pair.before for pair in group]) and are_same([pair.after for pair in group]))


def _compare(trial: str, group: Sequence[Pair]) -> TrialComparison:
    differences, is_one = [pair.difference for pair in group], _is_one(group)
    reachable = group[0].before.reachable
    return TrialComparison(
        trial=trial,
        pairs=len(group),
        reachable=reachable,
        before=fmean(pair.before.points for pair in group),
        after=fmean(pair.after.points for pair in group),
        difference=fmean(differences),
        interval=None if is_one else _within(mean_interval([differences]), reachable),
        better=sum(each > 0.0 for each in differences),
        worse=sum(each < 0.0 for each in differences),
        measures=changes(((pair.before, pair.after) for pair in group), are_sample=not is_one),
    )


def _within(interval: Interval | None, bound: float) -> Interval | None:
    return None if interval is None else (max(interval[0], -bound), min(interval[1], bound))


def read_evaluation(path: Path) -> list[Result]:
    """Return the results of an evaluation, from its folder or its file `summary.json`.

    Raises:
        UsageError: there is no such file, or it holds something else.
    """
    file = path / SUMMARY_NAME if os.path.isdir(path) else path
    try:
        document = json.loads(file.read_bytes())
    except OSError as error:
        raise UsageError(f"{file}: cannot be read: {error.strerror}; give the folder of an evaluation") from error
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file}: not a summary of an evaluation: {error}; repeat the evaluation") from error
    try:
        entries = [dict(each) for each in document["results"]]
    except (TypeError, ValueError, KeyError) as error:
        raise UsageError(f"{file}: not a summary of an evaluation; give the folder of an evaluation") from error
    for entry in entries:
        for judgement in ("passed", "shortcoming"):  # they depend on the options of the evaluation
            entry.pop(judgement, None)
    try:
        return [Result.from_json(entry) for entry in entries]
    except ResultError as error:
        raise UsageError(f"{file}: {error}; repeat the evaluation") from error
