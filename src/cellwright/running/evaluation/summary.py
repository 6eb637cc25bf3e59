"""Summary of many results: by trial, as evidence in lines, and as a JUnit file."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any
from xml.etree import ElementTree

from cellwright.running.evaluation.result import Result
from cellwright.running.run import versions
from cellwright.util.errors import UsageError


def evidence_lines(result: Result) -> Iterator[str]:
    """Yield how a run ended and what it earned; a line for each ordered part and for each object without use."""
    yield f"{result.ending}: {result.points:g} of {result.reachable:g} points"
    for order in result.score.get("orders", ()):
        for kit in order["kits"]:
            yield f"{order['order_id']}, kit {kit['kit_type']}: {kit_words(kit)}"
            for part in kit["parts"]:
                yield f"  {part['presence'] + part['pose']:g} of 2  {part['type']}: {part['sentence']}"
            for extra in kit["extras"]:
                yield f"  extra: {extra['name']} ({extra['reason']})"


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
    """Return why a run did not pass, in one line; empty if it did."""
    if not result.is_done:
        return result.reason
    if threshold is not None and not threshold.is_reached(result):
        return f"{result.points:g} of {result.reachable:g} points, below the required {threshold}"
    return ""


@dataclass(frozen=True, slots=True)
class TrialSummary:
    """Figures over the runs of one trial.

    Attributes:
        reachable: the most points that an agent can earn in it.
        best: points of its orders if all of them could be reached.
        mean: mean of the points; a run without a report counts as 0.
        share: mean over reachable.
    """

    trial: str
    runs: int
    reachable: float
    best: float
    mean: float
    min: float
    max: float
    share: float
    outcomes: Mapping[str, int]
    real_time_factor: float


def summarize(results: Iterable[Result]) -> list[TrialSummary]:
    """Return a summary of each trial, in the order of their first results."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.trial, []).append(result)
    return [
        TrialSummary(
            trial=trial,
            runs=len(group),
            reachable=group[0].reachable,
            best=group[0].best,
            mean=fmean(result.points for result in group),
            min=min(result.points for result in group),
            max=max(result.points for result in group),
            share=fmean(result.share for result in group),
            outcomes=dict(Counter(result.outcome for result in group)),
            real_time_factor=real_time_factor(group),
        )
        for trial, group in groups.items()
    ]


def real_time_factor(results: Iterable[Result]) -> float:
    """Return all simulated seconds over all wall seconds of the runs, without the lost ones."""
    finished = [result for result in results if not result.is_lost]
    wall = sum(result.wall for result in finished)
    return sum(result.simulated for result in finished) / wall if wall > 0 else 0.0


def worst_first(results: Iterable[Result]) -> list[Result]:
    """Return lost runs, then runs that were not done, then the others, each from the smallest share of points on."""
    return sorted(results, key=lambda each: (not each.is_lost, each.is_done, each.share))


def summary_document(results: Sequence[Result], threshold: Threshold | None, status: int) -> dict[str, Any]:
    """Return all results as JSON values, for programs; times in s."""
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


_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that an XML file cannot hold in any form."""


def junit(results: Sequence[Result], threshold: Threshold | None) -> bytes:
    """Return the JUnit file: a test case for each run, in a class for each trial."""
    short = [shortcoming(result, threshold) for result in results]
    counts = {"tests": str(len(results)), "failures": str(sum(map(bool, short))), "errors": "0", "skipped": "0"}
    times = {"time": f"{sum(result.wall for result in results):.3f}"}
    suites = ElementTree.Element("testsuites", counts | times)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": "cellwright eval", **counts, **times})
    for result, reason in zip(results, short, strict=True):
        _add_case(suite, result, reason)
    ElementTree.indent(suites)
    return bytes(ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True))


def _add_case(suite: ElementTree.Element, result: Result, reason: str) -> None:
    name = f"seed {result.seed}{' varied' if result.vary else ''}"
    case = ElementTree.SubElement(
        suite, "testcase", {"classname": _clean(result.trial), "name": name, "time": f"{result.wall:.3f}"}
    )
    evidence = "\n".join(evidence_lines(result))
    if reason:
        failure = ElementTree.SubElement(case, "failure", {"message": _clean(reason), "type": result.outcome})
        failure.text = _clean(evidence)
    ElementTree.SubElement(case, "system-out").text = _clean(evidence)
    if result.log:
        ElementTree.SubElement(case, "system-err").text = _clean("\n".join(result.log))


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
