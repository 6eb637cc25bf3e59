"""Comparison of two evaluations, paired by trial and seed."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.results.intervals import Interval, error_of, mean_interval
from cellwright.running.evaluation.results.measures import Change, changes
from cellwright.running.evaluation.results.power import Power
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.running.evaluation.results.summary import are_same, done_interval, share_interval
from cellwright.running.evaluation.results.verdict import Judgement, Verdict, judge, more_pairs
from cellwright.util.errors import UsageError
from cellwright.util.files import open_below, open_to_read

SUMMARY_NAME = "summary.json"
QUESTIONS: Mapping[str, Callable[[Result], float]] = {
    "points": lambda result: result.share,
    "runs done": lambda result: float(result.is_done),
}
"""Values of a run that decide, from 0 to 1: its share of the reachable points, and whether it was done."""


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
        others = {_identity(result): result for result in after if result.is_scored}
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
        return _within(mean_interval([[pair.share for pair in group] for group in groups], _seeds(groups)), 1.0)

    def judgements(self, margin: float) -> dict[str, Judgement]:
        """Return the judgement of each of the `QUESTIONS`; `margin` is the loss that is accepted, 0 to 1."""
        return {name: judge(*self._values(value, margin)) for name, value in QUESTIONS.items()}

    def _values(
        self, value: Callable[[Result], float], margin: float
    ) -> tuple[list[tuple[float, float]], list[float], float]:
        """Return the values of the seeds that matter, the differences of the other pairs, and the margin, for `judge`.

        Pairs of one seed in several trials are summed: its cell is laid out alike in them, so they turn together.
        """
        by_seed: dict[int, tuple[float, float]] = {}
        count = 0
        fixed: list[float] = []
        for group in self._groups().values():
            values = [(value(pair.before), value(pair.after)) for pair in group]
            # Such pairs are facts and no sample. As a sample they would hide the spread of the others.
            if _is_exact(group) or all(before == after for before, after in values):
                fixed += [after - before for before, after in values]
                continue
            count += len(group)
            for pair, (before, after) in zip(group, values, strict=True):
                sums = by_seed.get(pair.before.seed, (0.0, 0.0))
                by_seed[pair.before.seed] = sums[0] + before, sums[1] + after
        # `judge` takes the margin once for each value; here each pair may lose as much.
        each = margin * (count + len(fixed)) / (len(by_seed) + len(fixed))
        return list(by_seed.values()), fixed, each

    def more_seeds(self, margin: float) -> int | None:
        """Return about how many more seeds of each trial end an inconclusive comparison; None if no number is known."""
        found = 0
        for name, judgement in self.judgements(margin).items():
            if judgement.verdict is Verdict.INCONCLUSIVE:
                seeds = more_pairs(*self._values(QUESTIONS[name], margin))
                if seeds is None:
                    return None
                found = max(found, seeds)
        return found

    def power(self) -> dict[str, Power]:
        """Return what the comparison can see of each of the `QUESTIONS`; empty if no seed matters."""
        return {} if self.interval is None else {name: self._power_of(value) for name, value in QUESTIONS.items()}

    def _power_of(self, value: Callable[[Result], float]) -> Power:
        groups = list(self._groups().values())
        differences = [[value(pair.after) - value(pair.before) for pair in group] for group in groups]
        seeds = len({pair.before.seed for pair in self.pairs})
        values = {value(each) for pair in self.pairs for each in (pair.before, pair.after)}
        if len(groups) == 1 and values <= {0.0, 1.0}:
            lost, gained = (differences[0].count(each) / seeds for each in (-1.0, 1.0))
            return Power.of_rate(seeds, lost, gained)
        deviation = math.sqrt(error_of(differences, _seeds(groups))[0] * seeds)
        return Power.of_mean(seeds, fmean(each for group in differences for each in group), deviation)

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
        judgements = self.judgements(margin)
        verdict = overall(judgements)
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
            "verdict": verdict.value,
            "chances": {name: each.chance for name, each in judgements.items()},
            "more_seeds": self.more_seeds(margin) if verdict is Verdict.INCONCLUSIVE else 0,
            "regression": verdict is Verdict.WORSE,
            "trials": [asdict(each) for each in self.trials()],
            "power": {name: each.as_json() for name, each in self.power().items()},
            "turned": [pair.as_json() for pair in self.turned],
        }

    def _groups(self) -> dict[str, list[Pair]]:
        groups: dict[str, list[Pair]] = {}
        for pair in self.pairs:
            groups.setdefault(pair.before.trial, []).append(pair)
        return groups


def _seeds(groups: Iterable[Sequence[Pair]]) -> list[list[int]]:
    return [[pair.before.seed for pair in group] for group in groups]


def overall(judgements: Mapping[str, Judgement]) -> Verdict:
    """Return the verdict on all questions: the most serious, or better if one is better and none worse."""
    verdicts = [each.verdict for each in judgements.values()]
    for verdict in (Verdict.WORSE, Verdict.INCONCLUSIVE, Verdict.BETTER):
        if verdict in verdicts:
            return verdict
    return Verdict.NOT_WORSE


def _identity(result: Result) -> tuple[str, int, bool]:
    return result.trial, result.seed, result.vary


def _is_one(group: Sequence[Pair]) -> bool:
    """Return whether pairs are one alone, or one and the same: then they are no sample."""
    return len(group) == 1 or (are_same([pair.before for pair in group]) and are_same([pair.after for pair in group]))


def _is_exact(group: Sequence[Pair]) -> bool:
    """Return whether every seed would repeat the pairs of a trial.

    A single pair without variation is the trial as it was requested. With variation it is one of many.
    """
    if len(group) == 1:
        return not group[0].before.vary
    return _is_one(group) or (any(map(are_same, _sides(group))) and all(map(_end_alike, _sides(group))))


def _sides(group: Sequence[Pair]) -> Iterator[list[Result]]:
    yield [pair.before for pair in group]
    yield [pair.after for pair in group]


def _end_alike(runs: Sequence[Result]) -> bool:
    """Return whether runs end alike, such as by an error at the same time: `are_same` needs parts on a tray."""
    return len({(each.outcome, each.reason, each.points, each.simulated) for each in runs}) == 1


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
        with open_below(file.parent, file.name) if path.is_dir() else open_to_read(file) as stream:
            document = json.loads(stream.read())
    except OSError as error:
        raise UsageError(f"{file}: cannot be read: {error.strerror}; give the folder of an evaluation") from error
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file}: not a summary of an evaluation: {error}; repeat the evaluation") from error
    try:
        entries = [dict(each) for each in document["results"]]
    except (TypeError, ValueError, KeyError) as error:
        raise UsageError(f"{file}: not a summary of an evaluation; give the folder of an evaluation") from error
    for entry in entries:
        # they depend on the options of the evaluation
        for judgement in ("passed", "shortcoming"):
            entry.pop(judgement, None)
    try:
        return [Result.from_json(entry) for entry in entries]
    except ResultError as error:
        raise UsageError(f"{file}: {error}; repeat the evaluation") from error
