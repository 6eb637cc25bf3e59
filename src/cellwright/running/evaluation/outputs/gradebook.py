"""Gradebook of a class, as CSV and as a page: for each program its points, how runs ended, and hints of copies."""

from __future__ import annotations

import csv
import io
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.outputs.html import document, escape, table
from cellwright.running.evaluation.plan.roster import Student
from cellwright.running.evaluation.results import summary
from cellwright.running.evaluation.results.result import Lost, Result
from cellwright.util.errors import printable

FEEDBACK = "feedback"
"""Folder with a file for each program."""

_MIN_EQUAL = 2  # runs with equal last states that hint at a copy; one may be a coincidence
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # what a spreadsheet takes for the begin of a formula


@dataclass(frozen=True, slots=True)
class Row:
    """A program's row.

    Attributes:
        student: the program.
        runs: number of runs with a result.
        judged: those with points to earn.
        passed: those that passed.
        share: mean share of the attainable points, 0 to 1; None if nothing could be earned.
        points: mean points of each trial, by its name.
        outcomes: counts of the runs that ended in each way.
        reason: reason of the worst run not to pass; empty if all passed.
        equal: number of runs with points that ended in the same state, by the name of the other program.
        wall: wall time of all runs [s].
    """

    student: Student
    runs: int
    judged: int
    passed: int
    share: float | None
    points: Mapping[str, float]
    outcomes: Mapping[str, int]
    reason: str
    equal: Mapping[str, int]
    wall: float

    @property
    def is_refused(self) -> bool:
        """True if the program could not be made."""
        return Lost.REFUSED.value in self.outcomes

    @property
    def is_made(self) -> bool:
        """True if the program could be made in a run at least."""
        return not self.outcomes.keys() <= {Lost.REFUSED.value, Lost.NOT_RUN.value}

    @property
    def feedback(self) -> str:
        """Path of its feedback, from the folder of the evaluation."""
        return f"{FEEDBACK}/{self.student.file_name}.html"

    @property
    def endings(self) -> str:
        """Endings of its runs, in words."""
        return ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in self.outcomes.items())

    @property
    def hint(self) -> str:
        """Other programs whose runs ended in the same states, in words; empty if there is none."""
        return ", ".join(f"{name} ({count} runs)" for name, count in self.equal.items())

    def as_json(self) -> dict[str, Any]:
        """Return the row as JSON values."""
        return {
            "name": self.student.name,
            "agent": self.student.agent,
            **{name: getattr(self, name) for name in ("runs", "judged", "passed", "share", "reason", "wall")},
            **{name: dict(getattr(self, name)) for name in ("points", "outcomes", "equal")},
            "feedback": self.feedback,
        }


def rows(
    students: Sequence[Student], results: Mapping[str, Sequence[Result]], threshold: summary.Threshold | None
) -> list[Row]:
    """Return a row for each program; `results` are its runs by `Student.agent`."""
    equal = equal_runs(results)
    names = {student.agent: student.name for student in students}
    found = []
    for student in students:
        own = results.get(student.agent, ())
        passed, judged = summary.passed_count(own, threshold)
        reasons = (summary.shortcoming(each, threshold) for each in summary.worst_first(own) if not each.is_unjudged)
        trials = summary.by_trial(own)
        found.append(
            Row(
                student=student,
                runs=len(own),
                judged=judged,
                passed=passed,
                share=summary.mean_share(own),
                points={trial: fmean(each.points for each in group) for trial, group in trials.items()},
                outcomes=dict(Counter(each.outcome for each in own)),
                reason=next(filter(None, reasons), ""),
                equal={names[other]: count for other, count in equal.get(student.agent, {}).items()},
                wall=sum(each.wall for each in own),
            )
        )
    return found


def equal_runs(results: Mapping[str, Sequence[Result]]) -> dict[str, dict[str, int]]:
    """Return how many runs of two programs ended in the same state, by program and program, if there are several.

    Only runs with points count: programs that do nothing end alike. A run without variation may be the same for all
    seeds; then it counts once.
    """
    # A set for each state: two runs of one program in the same state are one hint.
    ended: dict[tuple[str, str], set[str]] = defaultdict(set)
    for agent, own in results.items():
        for each in own:
            if each.state_hash and each.points > 0.0:
                ended[each.trial, each.state_hash].add(agent)
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for agents in ended.values():
        for agent in agents:
            found[agent].update(agents - {agent})
    several = {
        agent: {other: count for other, count in sorted(counts.items()) if count >= _MIN_EQUAL}
        for agent, counts in found.items()
    }
    return {agent: counts for agent, counts in several.items() if counts}


def csv_sheet(found: Sequence[Row]) -> str:
    """Return the sheet as CSV, for spreadsheets: shares in percent, a column with the mean points of each trial."""
    trials = list(dict.fromkeys(trial for row in found for trial in row.points))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = ["name", "share, %", "passed", "judged", "runs", *(f"points: {trial}" for trial in trials)]
    writer.writerow(map(_cell, [*heads, "endings", "reason", "same end states as", "wall, s", "program", "feedback"]))
    for row in found:
        share = "" if row.share is None else f"{row.share:.1%}".removesuffix("%")
        points = [f"{row.points[trial]:.4g}" if trial in row.points else "" for trial in trials]
        figures = [share, str(row.passed), str(row.judged), str(row.runs), *points]
        words = [row.endings, row.reason, row.hint, f"{row.wall:.1f}", row.student.agent, row.feedback]
        writer.writerow(map(_cell, [row.student.name, *figures, *words]))
    return text.getvalue()


def page(found: Sequence[Row], threshold: summary.Threshold | None) -> str:
    """Return the sheet as an HTML file, with a link to the feedback of each program; rows as of the roster."""
    trials = list(dict.fromkeys(trial for row in found for trial in row.points))
    heads = [("name", ""), ("share", "n"), ("passed", "n"), *((trial, "n") for trial in trials), ("runs", "")]
    heads += [("worst run", ""), ("same end states as", ""), ("wall, s", "n")]
    required = "" if threshold is None else f"; required of every run: {threshold}"
    refused = sum(row.is_refused for row in found)
    tail = f"; {refused} cannot be run" if refused else ""
    words = f"Mean points by trial{required}{tail}"
    body = [
        f'<h1>{len(found)} programs</h1><p class="soft">{escape(words)}</p>',
        f'<div class="card scroll">{table(heads, (_table_row(row, trials) for row in found))}</div>',
        '<p class="soft">Equal end states of several runs are a hint of a copy, and no proof.</p>',
    ]
    return document(f"Class: {len(found)} programs", "\n".join(body))


def _cell(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula: names and reasons come from the programs."""
    shown = printable(text, len(text))
    return f"'{shown}" if shown.startswith(_FORMULA) else shown


def _table_row(row: Row, trials: Sequence[str]) -> str:
    share = "-" if row.share is None else f"{row.share:.0%}"
    kind = "bad" if row.passed < row.judged else "good" if row.judged else ""
    figures = [share, f"{row.passed} of {row.judged}"]
    figures += [f"{row.points[trial]:.4g}" if trial in row.points else "-" for trial in trials]
    cells = "".join(f'<td class="n">{escape(text)}</td>' for text in figures)
    name = f'<a href="{escape(row.feedback)}" title="{escape(row.student.agent)}">{escape(row.student.name)}</a>'
    words = "".join(f'<td class="tight">{escape(text)}</td>' for text in (row.endings, row.reason, row.hint))
    return f'<tr><td class="{kind}"><b>{name}</b></td>{cells}{words}<td class="n">{row.wall:.0f}</td></tr>\n'
