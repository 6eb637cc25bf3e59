"""Measured quantities of a run beside its points: time, and how exactly its parts lie."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any

from cellwright.running.evaluation.results.intervals import Interval, mean_interval
from cellwright.running.evaluation.results.result import Result


@dataclass(frozen=True, slots=True)
class Measure:
    """A measured quantity.

    Attributes:
        name: its name in JSON, with values in s, m and rad.
        label: its name in tables, with the unit there.
        scale: factor from the unit of JSON to that of tables.
        values: returns the values of a run; empty if it has none.
    """

    name: str
    label: str
    scale: float
    values: Callable[[Result], list[float]]


@dataclass(frozen=True, slots=True)
class Statistic:
    """Mean and spread of a quantity over runs.

    Attributes:
        runs: runs that have values.
        mean: mean of the means of the runs.
        interval: 95 % interval of the mean; None for one run, or if all runs are the same.
        deviation: standard deviation of all values, such as those of parts; None for a single one.
    """

    runs: int
    mean: float
    interval: Interval | None
    deviation: float | None


def parts(result: Result) -> Iterator[Mapping[str, Any]]:
    """Yield the evidence of each ordered part."""
    return (part for order in result.score.get("orders", ()) for kit in order["kits"] for part in kit["parts"])


def _errors(result: Result, name: str) -> list[float]:
    """Return how far parts are from their places; a place off the tray has no error, since no part reaches it."""
    found = (part[name] for part in parts(result) if part["reachable_pose"] > 0.0)
    return [float(value) for value in found if isinstance(value, int | float)]


MEASURES = (
    Measure("time", "time, s", 1.0, lambda result: [result.simulated] if result.is_done else []),
    Measure("distance", "off, mm", 1e3, lambda result: _errors(result, "distance")),
    Measure("yaw_difference", "turned, mrad", 1e3, lambda result: _errors(result, "yaw_difference")),
)
"""Time until the competition ended, of runs that are done; distance and yaw of submitted parts from their places."""


def statistics(results: Sequence[Result], *, are_sample: bool) -> dict[str, Statistic]:
    """Return the statistic of each measure that a run has, by name.

    Args:
        results: runs of one trial.
        are_sample: False if all of them are the same run.
    """
    found = {}
    for measure in MEASURES:
        values = [each for each in map(measure.values, results) if each]
        if values:
            means, pooled = [fmean(each) for each in values], [value for each in values for value in each]
            interval = mean_interval([means]) if are_sample else None
            if interval is not None:  # no quantity is negative
                interval = max(0.0, interval[0]), interval[1]
            deviation = stdev(pooled) if len(pooled) > 1 else None
            found[measure.name] = Statistic(len(values), fmean(means), interval, deviation)
    return found


@dataclass(frozen=True, slots=True)
class Change:
    """Change of a quantity between two evaluations, over the pairs of runs in which both have it."""

    pairs: int
    before: float
    after: float
    difference: float
    interval: Interval | None


def changes(pairs: Iterable[tuple[Result, Result]], *, are_sample: bool) -> dict[str, Change]:
    """Return the change of each measure that both runs of a pair have, by name; arguments as of `statistics`."""
    known, found = list(pairs), {}
    for measure in MEASURES:
        values = [(measure.values(before), measure.values(after)) for before, after in known]
        means = [(fmean(before), fmean(after)) for before, after in values if before and after]
        if means:
            differences = [after - before for before, after in means]
            found[measure.name] = Change(
                len(means),
                fmean(before for before, _ in means),
                fmean(after for _, after in means),
                fmean(differences),
                mean_interval([differences]) if are_sample else None,
            )
    return found
