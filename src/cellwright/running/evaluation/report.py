"""The report: one HTML file with everything in it, the worst runs first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.evidence_lines import kit_words
from cellwright.running.evaluation.pictures import histogram, timeline_picture
from cellwright.running.evaluation.report_style import STYLE
from cellwright.running.evaluation.result import OUTCOMES, Result
from cellwright.running.evaluation.summary import (
    Threshold,
    TrialSummary,
    real_time_factor,
    shortcoming,
    summarize,
    worst_first,
)
from cellwright.running.run import versions

_OPEN = 3  # runs that are shown at length from the start, if they lost points
_SHORT = {"memory_limit": "memory", "log_limit": "log", "died": "died", "gave_up": "gave up"}

_KEY = (
    ("order", "order, until it is complete"),
    ("open", "order, never complete"),
    ("held", "a part in the gripper"),
    ("delivering", "AGV delivering"),
    ("preparing_to_deliver", "AGV preparing or returning"),
)


def report(results: Sequence[Result], threshold: Threshold | None) -> str:
    """The page."""
    agents = ", ".join(sorted({result.agent for result in results})) or "nobody"
    known = ", ".join(f"{name} {version}" for name, version in versions().items())
    body = [
        f"<h1>{escape(agents)}</h1>",
        f'<p class="soft">{_subtitle(results, threshold)}</p>',
        f'<div class="tiles">{"".join(_tiles(results, threshold))}</div>',
        "<h2>Trials</h2>",
        _trials(results),
        "<h2>Runs, the worst first</h2>",
        _key(),
        *_runs(results, threshold),
        f'<p class="soft">{escape(known)}</p>',
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(agents)}: evaluation</title><style>{STYLE}</style></head>\n"
        f"<body><main>\n{chr(10).join(body)}\n</main></body></html>\n"
    )


def _subtitle(results: Sequence[Result], threshold: Threshold | None) -> str:
    trials, seeds = len({each.trial for each in results}), len({each.seed for each in results})
    varied = ", varied" if any(each.vary for each in results) else ""
    asked = "" if threshold is None else f"; every run was to reach {threshold}"
    return f"{_count(trials, 'trial')}, {_count(seeds, 'seed')}{varied}{asked}"


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _tiles(results: Sequence[Result], threshold: Threshold | None) -> Iterator[str]:
    share = fmean(each.share for each in results) if results else 0.0
    passed = sum(not shortcoming(each, threshold) for each in results)
    lost = sum(each.is_lost for each in results)
    yield _tile(f"{share:.1%}", "of the points within reach", _grade(share))
    yield _tile(f"{passed} of {len(results)}", "runs passed", "good" if passed == len(results) else "bad")
    yield _tile(str(sum(each.is_done for each in results)), "brought to the end")
    yield _tile(str(lost), "lost: killed, died, out of bounds", "bad" if lost else "")
    yield _tile(f"{real_time_factor(results):.0f} x", "real time")


def _tile(value: str, words: str, kind: str = "") -> str:
    return f'<div class="tile"><b class="{kind}">{escape(value)}</b><span>{escape(words)}</span></div>'


def _trials(results: Sequence[Result]) -> str:
    heads = [("trial", ""), ("scores", ""), ("mean", "n"), ("min", "n"), ("max", "n"), ("within reach", "n")]
    heads += [("share", "n"), ("outcomes", ""), ("x real time", "n")]
    head = "".join(f'<th class="{kind}">{name}</th>' for name, kind in heads)
    rows = "".join(_trial(each, [r.points for r in results if r.trial == each.trial]) for each in summarize(results))
    return f'<div class="card"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _trial(summary: TrialSummary, points: Sequence[float]) -> str:
    outcomes = ", ".join(f"{count} {_short(name)}" for name, count in summary.outcomes.items())
    numbers = [summary.mean, summary.least, summary.most, summary.reachable]
    cells = "".join(f'<td class="n">{number:.4g}</td>' for number in numbers)
    return (
        f"<tr><td><b>{escape(summary.trial)}</b></td><td>{histogram(points, summary.reachable)}</td>{cells}"
        f'<td class="n {_grade(summary.share)}">{summary.share:.0%}</td><td class="tight">{escape(outcomes)}</td>'
        f'<td class="n">{summary.real_time_factor:.1f}</td></tr>'
    )


def _key() -> str:
    marks = "".join(
        f'<span><svg viewBox="0 0 16 12"><rect class="{kind}" width="16" height="12" rx="2"/></svg>{words}</span>'
        for kind, words in _KEY
    )
    kit = '<svg viewBox="0 0 16 12"><path class="kit" d="M8 1l5 5l-5 5l-5 -5z"/></svg>'
    return f'<p class="key">{marks}<span>{kit}kit submitted, with its points</span></p>'


def _runs(results: Sequence[Result], threshold: Threshold | None) -> Iterator[str]:
    for number, result in enumerate(worst_first(results)):
        is_open = " open" if number < _OPEN and (shortcoming(result, threshold) or result.share < 1.0) else ""
        yield f"<details{is_open}>{_head(result, threshold)}\n{_inside(result, threshold)}</details>"


def _head(result: Result, threshold: Threshold | None) -> str:
    kind = "bad" if not result.is_done else "fair" if shortcoming(result, threshold) else "good"
    meter = (
        f'<div class="meter"><i class="{_grade(result.share)}" style="width:{max(0.0, result.share):.1%}"></i></div>'
    )
    return (
        f"<summary><b>{escape(result.name)}</b>"
        f'<span class="badge {kind}">{escape(_short(result.outcome))}</span>'
        f"<span>{result.points:g} of {result.reachable:g}</span>{meter}"
        f'<span class="soft">{result.wall:.1f} s</span></summary>'
    )


def _inside(result: Result, threshold: Threshold | None) -> str:
    found = []
    why = shortcoming(result, threshold)
    if why:
        found.append(f'<p class="bad">{escape(why)}</p>')
    if result.timeline:
        found.append(f'<div class="scroll">{timeline_picture(result.timeline)}</div>')
    found += [_kit(order, kit) for order in result.score.get("orders", ()) for kit in order["kits"]]
    if result.log:
        found.append(f"<h3>Last lines of its log</h3><pre>{escape(chr(10).join(result.log))}</pre>")
    told = f"{result.ending}; {result.simulated:.1f} s simulated in {result.wall:.1f} s"
    state = f"; state <code>{escape(result.state_hash)}</code>" if result.state_hash else ""
    found.append(f'<p class="soft">{escape(told)}{state}</p>')
    if result.command:
        found.append(f'<p class="soft">again: <code>{escape(result.command)}</code></p>')
    return f'<div class="inside">{"".join(found)}</div>'


def _kit(order: Mapping[str, Any], kit: Mapping[str, Any]) -> str:
    words, _, more = kit_words(kit).partition(": ")
    title = f"<h3>{escape(order['order_id'])}, kit {escape(kit['kit_type'])}: {escape(words)}</h3><p>{escape(more)}</p>"
    heads = [("part", ""), ("there", "n"), ("pose", "n"), ("why", "")]
    head = "".join(f'<th class="{kind}">{name}</th>' for name, kind in heads)
    rows = "".join(map(_part, kit["parts"]))
    besides = "".join(f"<p>besides: {escape(each['name'])} ({escape(each['reason'])})</p>" for each in kit["extras"])
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{besides}"


def _part(part: Mapping[str, Any]) -> str:
    earned, could = part["presence"] + part["pose"], part["reachable_presence"] + part["reachable_pose"]
    kind = "good" if earned >= could else "fair" if earned else "bad"
    cells = [(part["type"], ""), (f"{part['presence']:g}", "n"), (f"{part['pose']:g}", "n"), (part["sentence"], kind)]
    row = "".join(f'<td class="tight {kind}">{escape(text)}</td>' for text, kind in cells)
    return f"<tr>{row}</tr>"


def _short(outcome: str) -> str:
    return _SHORT.get(outcome) or (outcome.replace("_", " ") if outcome in OUTCOMES else outcome)


def _grade(share: float) -> str:
    return "good" if share >= 0.9 else "fair" if share >= 0.6 else "bad"
