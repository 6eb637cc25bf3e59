"""What many results come to: per trial, and against the score that was asked for."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.result import Result
from cellwright.running.run import versions
from cellwright.util.errors import UsageError


@dataclass(frozen=True, slots=True)
class Threshold:
    """A score that every run is to reach: points, or a share of those within reach (0 to 1)."""

    value: float
    is_share: bool

    @classmethod
    def read(cls, text: str) -> Threshold:
        """What `8` or `75%` says.

        Raises:
            UsageError: neither.
        """
        number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise UsageError(f"{text}: give points, such as 8, or a share of those within reach, such as 75%")
        return cls(value / 100.0 if percent else value, percent)

    def is_reached(self, result: Result) -> bool:
        """Whether a result is as good as that."""
        return (result.share if self.is_share else result.points) >= self.value - 1e-9

    def __str__(self) -> str:
        return f"{self.value * 100:g} % of the points" if self.is_share else f"{self.value:g} points"


def shortcoming(result: Result, threshold: Threshold | None) -> str:
    """Why a run did not pass, in a line; empty when it did."""
    if not result.is_done:
        return result.reason
    if threshold is not None and not threshold.is_reached(result):
        return f"{result.points:g} of {result.reachable:g} points, but {threshold} were asked for"
    return ""


@dataclass(frozen=True, slots=True)
class TrialSummary:
    """What the runs of one trial come to.

    Attributes:
        trial: its name.
        runs: how many runs.
        reachable: the most points that anybody can earn in it.
        best: what its orders would earn if nothing were out of reach.
        mean: mean of the points; a run that has told nothing counts as 0.
        least: the least points of a run.
        most: the most points of a run.
        share: mean over reachable.
        outcomes: how many runs ended how.
        real_time_factor: all simulated seconds over all wall seconds.
    """

    trial: str
    runs: int
    reachable: float
    best: float
    mean: float
    least: float
    most: float
    share: float
    outcomes: Mapping[str, int]
    real_time_factor: float


def summarize(results: Iterable[Result]) -> list[TrialSummary]:
    """A summary for each trial, in the order in which they first come."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.trial, []).append(result)
    return [_summary(trial, group) for trial, group in groups.items()]


def _summary(trial: str, results: Sequence[Result]) -> TrialSummary:
    points = [result.points for result in results]
    return TrialSummary(
        trial=trial,
        runs=len(results),
        reachable=results[0].reachable,
        best=results[0].best,
        mean=fmean(points),
        least=min(points),
        most=max(points),
        share=fmean(result.share for result in results),
        outcomes=dict(Counter(result.outcome for result in results)),
        real_time_factor=real_time_factor(results),
    )


def real_time_factor(results: Iterable[Result]) -> float:
    """All simulated seconds over all wall seconds of the runs, lost ones left out."""
    told = [result for result in results if not result.is_lost]
    wall = sum(result.wall for result in told)
    return sum(result.simulated for result in told) / wall if wall > 0 else 0.0


def worst_first(results: Iterable[Result]) -> list[Result]:
    """Lost runs, then those that were not done, then the others, each from the smallest share of the points on."""
    return sorted(results, key=lambda each: (not each.is_lost, each.is_done, each.share))


def summary_document(results: Sequence[Result], threshold: Threshold | None, status: int) -> dict[str, Any]:
    """All results as JSON values, for programs; times in s."""
    return {
        "exit_status": status,
        "min_score": None if threshold is None else str(threshold),
        "runs": len(results),
        "passed": sum(not shortcoming(result, threshold) for result in results),
        "versions": versions(),
        "trials": [asdict(summary) for summary in summarize(results)],
        "results": [_run(result, threshold) for result in results],
    }


def _run(result: Result, threshold: Threshold | None) -> dict[str, Any]:
    short = shortcoming(result, threshold)
    return {"passed": not short, "shortcoming": short, **result.as_json()}
