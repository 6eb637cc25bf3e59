"""Page of a class: the gradebook as one HTML file, with a link to the feedback of each program."""

from collections.abc import Sequence

from cellwright.running.evaluation.outputs.gradebook import Row
from cellwright.running.evaluation.outputs.report import STYLE, escape
from cellwright.running.evaluation.results.summary import Threshold
from cellwright.running.run import versions


def page(found: Sequence[Row], threshold: Threshold | None) -> str:
    """Return the page; its rows are in the order of the roster."""
    trials = list(dict.fromkeys(trial for row in found for trial in row.points))
    heads = [("name", ""), ("share", "n"), ("passed", "n"), *((trial, "n") for trial in trials), ("runs", "")]
    heads += [("worst run", ""), ("same end states as", ""), ("wall, s", "n")]
    head = "".join(f'<th class="{kind}">{escape(name)}</th>' for name, kind in heads)
    required = "" if threshold is None else f"; required of every run: {threshold}"
    refused = sum(row.is_refused for row in found)
    tail = f"; {refused} cannot be run" if refused else ""
    words = f"Mean points by trial{required}{tail}"
    known = ", ".join(f"{name} {version}" for name, version in versions().items())
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Class: {len(found)} programs</title><style>{STYLE}</style></head>\n"
        f'<body><main>\n<h1>{len(found)} programs</h1><p class="soft">{escape(words)}</p>\n'
        f'<div class="card scroll"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(_row(row, trials) for row in found)}</tbody></table></div>\n"
        '<p class="soft">Equal end states of several runs are a hint of a copy, and no proof.</p>\n'
        f'<p class="soft">{escape(known)}</p>\n</main></body></html>\n'
    )


def _row(row: Row, trials: Sequence[str]) -> str:
    share = "-" if row.share is None else f"{row.share:.0%}"
    kind = "bad" if row.passed < row.judged else "good" if row.judged else ""
    figures = [share, f"{row.passed} of {row.judged}"]
    figures += [f"{row.points[trial]:.4g}" if trial in row.points else "-" for trial in trials]
    cells = "".join(f'<td class="n">{escape(text)}</td>' for text in figures)
    name = f'<a href="{escape(row.feedback)}" title="{escape(row.student.agent)}">{escape(row.student.name)}</a>'
    words = "".join(f'<td class="tight">{escape(text)}</td>' for text in (row.endings, row.reason, row.hint))
    return f'<tr><td class="{kind}"><b>{name}</b></td>{cells}{words}<td class="n">{row.wall:.0f}</td></tr>\n'
