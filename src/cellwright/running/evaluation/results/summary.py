"""Summary of many results: which passed, the figures of each trial with their intervals, and repetitions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.plan.job import repeated_key
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss
from cellwright.running.evaluation.results.intervals import Interval, rate_interval, score_interval
from cellwright.running.evaluation.results.measures import MEASURES, Statistic, parts, statistics
from cellwright.running.evaluation.results.result import Result
from cellwright.running.run import versions
from cellwright.util.errors import UsageError

_HASH = 8  # letters of a state hash that people compare


def kit_words(kit: Mapping[str, Any]) -> str:
    """Return the sums of a kit in words."""
    count = len(kit["parts"])
    words = f"{kit['total']:g} of {kit['reachable']:g} points"
    if kit["reachable"] < kit["best"]:
        words += f" attainable, {kit['best']:g} at most"
    if kit["submitted"]:
        words += f": present {kit['part_presence']:g} of {count}, pose {kit['part_pose']:g} of {count}, "
        words += f"bonus {kit['all_parts_bonus']:g} of {count} ({kit['bonus_reason']})"
    else:
        words += f": {kit['bonus_reason']}"
    return words


@dataclass(frozen=True, slots=True)
class Threshold:
    """Score that every run must reach: points, or a share of the reachable ones (0 to 1)."""

    value: float
    is_share: bool

    @classmethod
    def read(cls, text: str) -> Threshold:
        """Read a threshold such as `8` or `75%`.

        Raises:
            UsageError: the text is neither.
        """
        number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise UsageError(
                f"{text}: give points (for example 8) or a share of the attainable points (for example 75%)"
            )
        return cls(value / 100.0 if percent else value, percent)

    def is_reached(self, result: Result) -> bool:
        """Return whether a result reaches the threshold."""
        return (result.share if self.is_share else result.points) >= self.value - 1e-9

    def __str__(self) -> str:
        return f"{self.value * 100:g} % of the points" if self.is_share else f"{self.value:g} points"


def shortcoming(result: Result, threshold: Threshold | None) -> str:
    """Return why a run did not pass, in one line; empty if it did. A run without points to earn does not."""
    if not result.is_done:
        return result.reason
    if not result.is_scored:
        return "no point can be earned in this trial"
    if threshold is not None and not threshold.is_reached(result):
        return f"{result.points:g} of {result.reachable:g} points, below the required {threshold}"
    return ""


def scored(results: Iterable[Result]) -> list[Result]:
    """Return the runs that had points to earn: these alone count in shares, intervals and passes."""
    return [result for result in results if result.is_scored]


def are_tasks(results: Iterable[Result]) -> bool:
    """Return whether each trial has a task: the share of its points is then a rate of success."""
    groups = by_trial(results).values()
    return bool(groups) and all(any(each.success is not None for each in group) for group in groups)


def mean_share(results: Iterable[Result]) -> float | None:
    """Return the mean share of the attainable points; None if no run has points to earn."""
    shares = [result.share for result in scored(results)]
    return fmean(shares) if shares else None


def passed_count(results: Iterable[Result], threshold: Threshold | None) -> tuple[int, int]:
    """Return how many runs passed, and how many could have."""
    found = [not shortcoming(result, threshold) for result in scored(results)]
    return sum(found), len(found)


def unjudged_sentence(results: Iterable[Result]) -> str:
    """Return which trials were not judged, in a sentence; empty if there is none."""
    names = dict.fromkeys(result.trial for result in results if result.is_unjudged)
    return f"not judged, and not counted: {', '.join(names)} (no order with points to earn)" if names else ""


@dataclass(frozen=True, slots=True)
class Repeat:
    """A run and its repetition: the same trial, program and seed."""

    first: Result
    second: Result

    @property
    def difference(self) -> str:
        """Difference of the repetition, in one line; empty if it ended in the same state."""
        first, second = self.first, self.second
        if first.outcome != second.outcome:
            return f"{first.outcome.replace('_', ' ')}, then {second.outcome.replace('_', ' ')}"
        if first.state_hash == second.state_hash:
            return ""
        hashes = f"state {first.state_hash[:_HASH]}, then {second.state_hash[:_HASH]}"
        return hashes if first.points == second.points else f"{first.points:g}, then {second.points:g} points; {hashes}"

    def as_json(self) -> dict[str, Any]:
        """Return the repetition as JSON values."""
        return {
            "trial": self.first.trial,
            "seed": self.first.seed,
            "difference": self.difference,
            "points": [self.first.points, self.second.points],
            "outcomes": [self.first.outcome, self.second.outcome],
            "state_hashes": [self.first.state_hash, self.second.state_hash],
        }


def with_repeats(ended: Iterable[Result]) -> tuple[list[Result], list[Repeat]]:
    """Return the results of runs, and pairs of a run and its repetition, in the order of the runs.

    A repetition whose run has no result stands for the run.
    """
    found = {result.key: result for result in ended}
    seconds = {key: found.get(repeated_key(key)) for key in found}
    repeats = [Repeat(found[key], second) for key, second in seconds.items() if second is not None]
    repetitions = {each.second.key for each in repeats}
    return [result for key, result in found.items() if key not in repetitions], repeats


@dataclass(frozen=True, slots=True)
class TrialSummary:
    """Figures over the runs of one trial.

    Attributes:
        reachable: the most points that an agent can earn in it.
        best: points of its orders if all of them could be reached.
        mean: mean of the points; a run without a report counts as 0.
        mean_interval: 95 % interval of the mean; None for one run, or if all runs are the same.
        share: mean over reachable; None if there are no points to earn.
        share_interval: 95 % interval of the share.
        done: runs that brought the competition to its end.
        done_interval: 95 % interval of their share of the runs.
        passed: runs without a shortcoming.
        passed_interval: 95 % interval of their share of the runs.
        measures: time and placement, by the name of the measure.
        overrides: values that replaced those of the trial's files, as YAML texts by key.
        is_task: True if a run earns its only point by the success of its task; then a share is a rate of success.
    """

    trial: str
    runs: int
    reachable: float
    best: float
    mean: float
    mean_interval: Interval | None
    min: float
    max: float
    share: float | None
    share_interval: Interval | None
    done: int
    done_interval: Interval | None
    passed: int
    passed_interval: Interval | None
    outcomes: Mapping[str, int]
    measures: Mapping[str, Statistic]
    real_time_factor: float
    overrides: Mapping[str, str]
    is_task: bool = False


def summarize(results: Iterable[Result], threshold: Threshold | None = None) -> list[TrialSummary]:
    """Return a summary of each trial, in the order of their first results."""
    return [_summary(trial, group, threshold) for trial, group in by_trial(results).items()]


def by_trial(results: Iterable[Result]) -> dict[str, list[Result]]:
    """Return the results of each trial, in the order of their first results."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.trial, []).append(result)
    return groups


def _summary(trial: str, group: Sequence[Result], threshold: Threshold | None) -> TrialSummary:
    points = [result.points for result in group]
    is_sample = _is_sample(group)
    return TrialSummary(
        trial=trial,
        runs=len(group),
        reachable=group[0].reachable,
        best=group[0].best,
        mean=fmean(points),
        mean_interval=score_interval([points], group[0].reachable) if is_sample and group[0].is_scored else None,
        min=min(points),
        max=max(points),
        share=mean_share(group),
        share_interval=share_interval(group),
        done=sum(result.is_done for result in group),
        done_interval=done_interval(group),
        passed=passed_count(group, threshold)[0],
        passed_interval=passed_interval(group, threshold),
        outcomes=dict(Counter(result.outcome for result in group)),
        measures=statistics(group, are_sample=is_sample),
        real_time_factor=real_time_factor(group),
        overrides=group[0].overrides,
        is_task=are_tasks(group),
    )


def measure_rows(summaries: Iterable[TrialSummary]) -> list[list[str]]:
    """Return the rows of a table of time and placement: trial, measure, mean, 95 % interval, spread."""
    return [
        [
            each.trial,
            measure.label,
            f"{found.mean * measure.scale:.3g}",
            range_text(found.interval, measure.scale),
            "-" if found.deviation is None else f"{found.deviation * measure.scale:.3g}",
        ]
        for each in summaries
        for measure in MEASURES
        if (found := each.measures.get(measure.name)) is not None
    ]


def are_same(group: Sequence[Result]) -> bool:
    """Return whether several runs of a trial are one and the same, since its seeds change nothing.

    They end at the same time, with each part at the same place to the last bit.
    """
    first, *others = ((result.simulated, [part["distance"] for part in parts(result)]) for result in group)
    return bool(others) and any(each is not None for each in first[1]) and all(each == first for each in others)


def _is_sample(group: Sequence[Result]) -> bool:
    return len(group) > 1 and not are_same(group)


def share_interval(results: Sequence[Result]) -> Interval | None:
    """Return the 95 % interval of the mean share of points, 0 to 1, for other seeds of the same trials.

    Runs of one seed under several trials, or values of a sweep, count as one draw: its cell is laid out alike in them.
    None without results, if a trial has one run alone, or if all runs of each trial are the same.
    """
    groups = by_trial(scored(results)).values()
    if not any(map(_is_sample, groups)):
        return None
    return score_interval([[result.share for result in group] for group in groups], 1.0, _seeds(groups))


def passed_interval(results: Sequence[Result], threshold: Threshold | None) -> Interval | None:
    """Return the 95 % interval of the share of runs that pass, 0 to 1; None if no trial has runs that differ."""
    return _rate_interval(results, lambda result: not shortcoming(result, threshold))


def done_interval(results: Sequence[Result]) -> Interval | None:
    """Return the 95 % interval of the share of runs that are done, 0 to 1; None as of `passed_interval`."""
    return _rate_interval(results, lambda result: result.is_done)


def _rate_interval(results: Sequence[Result], is_success: Callable[[Result], bool]) -> Interval | None:
    groups = by_trial(scored(results)).values()
    if not any(map(_is_sample, groups)):
        return None
    if len(groups) > 1 and (
        found := score_interval([[float(is_success(each)) for each in group] for group in groups], 1.0, _seeds(groups))
    ):
        return found
    counted = [result for group in groups for result in group]
    return rate_interval(sum(map(is_success, counted)), len(counted))


def _seeds(groups: Iterable[Sequence[Result]]) -> list[list[int]]:
    return [[result.seed for result in group] for group in groups]


def with_interval(text: str, interval: Interval | None) -> str:
    """Return a text with the 95 % interval of a share behind it, in percent, if there is one."""
    return text if interval is None else f"{text} (95 %: {range_text(interval, 100.0, ' %')})"


def range_text(interval: Interval | None, scale: float = 1.0, unit: str = "") -> str:
    """Return an interval as text, such as `61 to 97 %`; a dash for None.

    Args:
        interval: lower and upper end.
        scale: factor of both.
        unit: text behind the ends.
    """
    if interval is None:
        return "-"
    low, high = (f"{end * scale:.3g}" for end in interval)
    return f"{low} to {high}{unit}"


def real_time_factor(results: Iterable[Result]) -> float:
    """Return all simulated seconds over all wall seconds of the runs, without the lost ones."""
    finished = [result for result in results if not result.is_lost]
    wall = sum(result.wall for result in finished)
    return sum(result.simulated for result in finished) / wall if wall > 0 else 0.0


def worst_first(results: Iterable[Result]) -> list[Result]:
    """Return lost runs, then runs that were not done, then the others, each from the smallest share of points on."""
    return sorted(results, key=lambda each: (not each.is_lost, each.is_done, each.share))


def summary_document(
    results: Sequence[Result],
    threshold: Threshold | None,
    status: int,
    repeats: Sequence[Repeat] = (),
    lost: Sequence[InfrastructureLoss] = (),
) -> dict[str, Any]:
    """Return all results as JSON values, for programs; times in s. Runs that are `lost` count in no figure."""
    return {
        "exit_status": status,
        "min_score": None if threshold is None else str(threshold),
        "runs": len(results),
        "passed": passed_count(results, threshold)[0],
        "unjudged": sum(result.is_unjudged for result in results),
        "passed_interval": passed_interval(results, threshold),
        "share": mean_share(results),
        "share_interval": share_interval(results),
        "versions": versions(),
        "infrastructure": [asdict(each) for each in lost],
        "repeats": [repeat.as_json() for repeat in repeats],
        "trials": [asdict(summary) for summary in summarize(results, threshold)],
        "results": [_run(result, threshold) for result in results],
    }


def _run(result: Result, threshold: Threshold | None) -> dict[str, Any]:
    short = shortcoming(result, threshold)
    return {"passed": not short, "shortcoming": short, **result.as_json()}
