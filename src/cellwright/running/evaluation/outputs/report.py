"""Report of an evaluation: one HTML file with its pictures, the worst runs first."""

import base64
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape as escape_markup
from typing import Any

from cellwright.running.evaluation.outputs.sweep_picture import STYLE as SWEEP_STYLE
from cellwright.running.evaluation.outputs.sweep_picture import sweep_picture
from cellwright.running.evaluation.results.result import OUTCOMES, Result
from cellwright.running.evaluation.results.summary import (
    Repeat,
    Threshold,
    TrialSummary,
    done_interval,
    kit_words,
    mean_share,
    measure_rows,
    passed_count,
    passed_interval,
    range_text,
    real_time_factor,
    share_interval,
    shortcoming,
    summarize,
    with_interval,
    worst_first,
)
from cellwright.running.run import versions
from cellwright.util.errors import printable

STYLE = """
:root { color-scheme: light dark; --paper: #f6f7f9; --card: #ffffff; --ink: #1b2430; --soft: #5d6b7c; --line: #dde2e9;
  --lane: #eef1f5; --accent: #2563b0; --good: #1d8a52; --fair: #b7791f; --bad: #c4382f; --held: #d97a1f; }
@media (prefers-color-scheme: dark) { :root { --paper: #12171e; --card: #1a212b; --ink: #e4e9f0; --soft: #93a1b3;
  --line: #2c3643; --lane: #222b37; --accent: #6aa5ee; --good: #4cc38a; --fair: #e0ac4f; --bad: #f0766c;
  --held: #f0a050; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 4px; letter-spacing: -0.01em; overflow-wrap: anywhere; }
h2 { font-size: 17px; margin: 36px 0 12px; }
h3 { font-size: 14px; margin: 18px 0 6px; font-weight: 600; }
p { margin: 4px 0; }
.soft { color: var(--soft); } .good { color: var(--good); } .fair { color: var(--fair); } .bad { color: var(--bad); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin-top: 22px; }
.tile, .card, details { background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
.tile { padding: 14px 16px; }
.tile b { display: block; font-size: 24px; line-height: 1.2; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: 13px; }
.card { padding: 4px 16px; overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-size: 12px; font-weight: 600; color: var(--soft); padding: 9px 12px 7px 0; }
td { padding: 7px 12px 7px 0; border-top: 1px solid var(--line); vertical-align: middle; }
th.n, td.n { text-align: right; } .n + :not(.n) { padding-left: 14px; } td.tight { font-size: 13px; }
details { margin-bottom: 10px; }
summary { display: grid; grid-template-columns: minmax(170px, 1.5fr) 150px 110px minmax(120px, 1.6fr) 90px; gap: 14px;
  align-items: center; padding: 11px 16px; cursor: pointer; list-style: none; }
summary::-webkit-details-marker { display: none; }
summary b::before { content: "\\25B8"; display: inline-block; width: 18px; color: var(--soft); }
details[open] summary b::before { content: "\\25BE"; }
summary b { font-weight: 600; overflow-wrap: anywhere; }
.meter { height: 8px; border-radius: 4px; background: var(--lane); overflow: hidden; }
.meter i { display: block; height: 100%; border-radius: 4px; background: var(--accent); }
.meter i.good { background: var(--good); } .meter i.fair { background: var(--fair); }
.meter i.bad { background: var(--bad); }
.badge { font-size: 12px; font-weight: 600; padding: 2px 9px; border-radius: 20px; border: 1px solid currentColor;
  justify-self: start; }
.inside { padding: 2px 16px 16px; border-top: 1px solid var(--line); }
pre, code { font: 12.5px/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
pre { background: var(--lane); padding: 10px 12px; border-radius: 8px; overflow-x: auto; margin: 6px 0; }
code { overflow-wrap: anywhere; }
svg { display: block; } svg.histogram { width: 132px; height: 34px; }
svg.timeline { width: 100%; min-width: 620px; height: auto; margin-top: 10px; }
.scroll { overflow-x: auto; }
img.state { display: block; width: 480px; max-width: 100%; border-radius: 8px; margin: 8px 0 2px; }
svg text { font: 12px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; fill: var(--soft); }
svg text.points { font-weight: 600; fill: var(--ink); font-size: 11px; }
.bar, .order { fill: var(--accent); } .open { fill: var(--bad); opacity: 0.75; } .lane { fill: var(--lane); }
.held { fill: var(--held); } .rule { stroke: var(--line); stroke-width: 1; }
.preparing_to_deliver { fill: var(--soft); opacity: 0.55; } .delivering { fill: var(--good); opacity: 0.75; }
.delivered { fill: var(--good); } .returning { fill: var(--soft); opacity: 0.35; }
.kit { fill: var(--card); stroke: var(--ink); stroke-width: 1.6; }
.key { display: flex; flex-wrap: wrap; gap: 16px; font-size: 12.5px; color: var(--soft); margin: 0 0 12px; }
.key svg { display: inline-block; width: 16px; height: 12px; vertical-align: -1px; margin-right: 5px; }
@media (max-width: 760px) { summary { grid-template-columns: 1fr 1fr; } }
@media print { body { background: none; } details { break-inside: avoid; } }
"""
"""Style sheet. It names no font, picture or file that a browser would have to fetch."""


_WIDTH, _LEFT, _RIGHT, _ROW, _BAR = 960, 84, 20, 24, 14
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
_MAX_BINS = 13
_OPEN = 3  # runs that the page shows opened, if they lost points
_SHORT = {"memory_limit": "memory", "log_limit": "log", "died": "died", "gave_up": "gave up"}
_LEGEND = (
    ("order", "order, until complete"),
    ("open", "order, never complete"),
    ("held", "a part in the gripper"),
    ("delivering", "AGV delivering"),
    ("preparing_to_deliver", "AGV preparing or returning"),
)


def histogram(values: Sequence[float], best: float) -> str:
    """Return a histogram of the scores as SVG, from 0 to the best [points]."""
    width, height = 132, 34
    bins = min(int(best) + 1, _MAX_BINS) if best >= 1 else 1
    counts = [0] * bins
    for value in values:
        counts[min(bins - 1, max(0, round(value / best * (bins - 1)))) if best > 0 else 0] += 1
    top, step = max(counts), width / bins
    bars = []
    for index, count in enumerate(counts):
        tall = max(2.0, count / top * (height - 6)) if count else 0.0
        points = best * index / (bins - 1) if bins > 1 else best
        words = f"{count} x about {points:g} points"
        bars.append(
            f'<rect class="bar" x="{index * step + 0.75:.1f}" y="{height - 1 - tall:.1f}" width="{step - 1.5:.1f}" '
            f'height="{tall:.1f}"><title>{words}</title></rect>'
        )
    label = f"scores from 0 to {best:g} points"
    line = f'<line class="rule" x1="0" y1="{height - 0.5}" x2="{width}" y2="{height - 0.5}"/>'
    return _svg(width, height, label, "".join(bars) + line, "histogram")


def timeline_picture(timeline: Mapping[str, Any]) -> str:
    """Return the timeline of a run as SVG: orders, what the gripper held, AGVs and the kits that they took away."""
    end = max(float(timeline["end"]), 1e-3)
    rows = [*((each["order"], _order(each)) for each in timeline["orders"])]
    rows.append(("gripper", [(held["begin"], held["end"], "held", held["part"]) for held in timeline["held"]]))
    for number, spans in sorted(timeline["agvs"].items()):
        moves = [
            (each["begin"], each["end"], each["state"], each["state"].replace("_", " "))
            for each in spans
            if each["state"] != "ready_to_deliver"
        ]
        rows.append((f"AGV {number}", moves))
    height = len(rows) * _ROW + 26
    parts = [_axis(end, len(rows) * _ROW)]
    for index, (name, spans) in enumerate(rows):
        parts.append(_row(index * _ROW, name, spans, end))
    lanes = {name: index for index, (name, _) in enumerate(rows)}
    parts += [_kit_mark(each, lanes.get(f"AGV {each['agv']}", 0) * _ROW, end) for each in timeline["kits"]]
    return _svg(_WIDTH, height, "timeline of the run", "".join(parts), "timeline")


def _order(order: Mapping[str, Any]) -> list[tuple[float, float | None, str, str]]:
    words = f"{order['order']}: announced"
    if order["completed"] is None:
        return [(order["announced"], None, "open", f"{words}, never completed")]
    return [(order["announced"], order["completed"], "order", f"{words} until completed")]


def _x(time: float, end: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - _RIGHT) * min(time, end) / end


def _row(y: int, name: str, spans: Sequence[tuple[float, float | None, str, str]], end: float) -> str:
    middle = y + _ROW / 2
    parts = [
        f'<text class="name" x="{_LEFT - 10}" y="{middle + 4}" text-anchor="end">{escape(name)}</text>',
        f'<rect class="lane" x="{_LEFT}" y="{middle - _BAR / 2}" width="{_WIDTH - _LEFT - _RIGHT}" height="{_BAR}"/>',
    ]
    for begin, stop, kind, words in spans:
        last = end if stop is None else stop
        width = max(1.5, _x(last, end) - _x(begin, end))
        title = f"{escape(words)}, {begin:.1f} s to {last:.1f} s"
        parts.append(
            f'<rect class="{kind}" x="{_x(begin, end):.1f}" y="{middle - _BAR / 2}" width="{width:.1f}" '
            f'height="{_BAR}" rx="2"><title>{title}</title></rect>'
        )
    return "".join(parts)


def _kit_mark(kit: Mapping[str, Any], y: float, end: float) -> str:
    x, middle = _x(kit["time"], end), y + _ROW / 2
    title = f"{escape(kit['kit'])} submitted at {kit['time']:.1f} s: {kit['points']:g} points"
    anchor, shift = ("end", -9) if x > _WIDTH - 120 else ("start", 9)
    return (
        f'<path class="kit" d="M{x:.1f} {middle - 8}l8 8l-8 8l-8 -8z"><title>{title}</title></path>'
        f'<text class="points" x="{x + shift:.1f}" y="{middle + 4}" text-anchor="{anchor}">'
        f"{kit['points']:g} points</text>"
    )


def _axis(end: float, y: float) -> str:
    step = next((each for each in _STEPS if end / each <= 10), math.ceil(end / 10))
    lines = []
    for number in range(int(end / step) + 1):
        time = round(number * step, 3)
        x = _x(time, end)
        lines.append(
            f'<line class="rule" x1="{x:.1f}" y1="0" x2="{x:.1f}" y2="{y + 4}"/>'
            f'<text class="tick" x="{x:.1f}" y="{y + 18}" text-anchor="middle">{time:g} s</text>'
        )
    return "".join(lines)


def _svg(width: int, height: int, label: str, content: str, kind: str) -> str:
    return f'<svg class="{kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{escape(label)}">{content}</svg>'


def escape(text: str) -> str:
    """Return a text as HTML, without characters that are not seen, such as those that turn the direction of text."""
    return escape_markup(printable(text, len(text)))


def report(
    results: Sequence[Result],
    threshold: Threshold | None,
    repeats: Sequence[Repeat] = (),
    pictures: Mapping[str, bytes] | None = None,
) -> str:
    """Return the page; `pictures` are PNG files by the keys of their results."""
    agents = ", ".join(sorted({result.agent for result in results})) or "no agent"
    known = ", ".join(f"{name} {version}" for name, version in versions().items())
    body = [
        f"<h1>{escape(agents)}</h1>",
        f'<p class="soft">{_subtitle(results, threshold)}</p>',
        f'<div class="tiles">{"".join(_tiles(results, threshold))}</div>',
        _sweep(results),
        "<h2>Trials</h2>",
        _trials(results, threshold),
        _measures(results),
        _repeats(repeats),
        "<h2>Runs, worst first</h2>",
        _legend(),
        *_runs(results, threshold, pictures or {}),
        f'<p class="soft">{_trust(results)}</p>',
        f'<p class="soft">{escape(known)}</p>',
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(agents)}: evaluation</title><style>{STYLE}{SWEEP_STYLE}</style></head>\n"
        f"<body><main>\n{chr(10).join(body)}\n</main></body></html>\n"
    )


def _trust(results: Sequence[Result]) -> str:
    """Return what the points of these results rely on, in a sentence."""
    if any(not each.over and not each.verified for each in results):
        return (
            "The program ran in the referee's process, and could have changed its score: "
            "--over socket and --verify are for programs that you do not trust."
        )
    ways = {
        "the program ran in a process of its own": all(each.over for each in results),
        "its commands alone gave the same result": all(each.verified or each.is_lost for each in results),
    }
    words = " and ".join(way for way, holds in ways.items() if holds)
    return f"{words.capitalize()}." if results and words else ""


def _subtitle(results: Sequence[Result], threshold: Threshold | None) -> str:
    trials, seeds = len({each.trial for each in results}), len({each.seed for each in results})
    varied = ", varied" if any(each.vary for each in results) else ""
    requirement = "" if threshold is None else f"; required of every run: {threshold}"
    return f"{_count(trials, 'trial')}, {_count(seeds, 'seed')}{varied}{requirement}"


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _tiles(results: Sequence[Result], threshold: Threshold | None) -> Iterator[str]:
    share = mean_share(results)
    passed, count = passed_count(results, threshold)
    failed = sum(each.has_failed for each in results)
    percent, grade = ("-", "") if share is None else (f"{share:.1%}", _grade(share))
    yield _tile(percent, with_interval("of the attainable points", share_interval(results)), grade)
    words = with_interval("runs passed", passed_interval(results, threshold))
    yield _tile(f"{passed} of {count}", words, "good" if passed == count > 0 else "bad")
    if unjudged := sum(each.is_unjudged for each in results):
        yield _tile(str(unjudged), "not judged, and not counted: no order with points to earn")
    words = with_interval("runs completed", done_interval(results))
    yield _tile(str(sum(each.is_done for each in results)), words)
    yield _tile(str(failed), "failed: crashed, unstable, killed or over a limit", "bad" if failed else "")
    yield _tile(f"{real_time_factor(results):.0f} x", "real time")


def _tile(value: str, words: str, kind: str = "") -> str:
    return f'<div class="tile"><b class="{kind}">{escape(value)}</b><span>{escape(words)}</span></div>'


def _trials(results: Sequence[Result], threshold: Threshold | None) -> str:
    heads = [("trial", ""), ("scores", ""), ("mean", "n"), ("95 %", "n"), ("min", "n"), ("max", "n")]
    heads += [("attainable", "n"), ("share", "n"), ("passed, 95 %", "n"), ("outcomes", ""), ("x real time", "n")]
    summaries = summarize(results, threshold)
    rows = (_trial(each, [r.points for r in results if r.trial == each.trial]) for each in summaries)
    return f'<div class="card">{_table(heads, rows)}</div>'


def _sweep(results: Sequence[Result]) -> str:
    picture = sweep_picture(summarize(results))
    return f'<h2>Sweep</h2><div class="card">{picture}</div>' if picture else ""


def _measures(results: Sequence[Result]) -> str:
    rows = measure_rows(summarize(results))
    if not rows:
        return ""
    heads = [("trial", ""), ("figure", ""), ("mean", "n"), ("95 %", "n"), ("spread", "n")]
    cells = [
        [f'<td class="{kind}">{escape(text)}</td>' for text, (_, kind) in zip(row, heads, strict=True)] for row in rows
    ]
    lines = (f"<tr>{''.join(row)}</tr>" for row in cells)
    return f'<h2>Time and placement</h2><div class="card">{_table(heads, lines)}</div>'


def _repeats(repeats: Sequence[Repeat]) -> str:
    if not repeats:
        return ""
    differences = [(repeat.first.name, repeat.difference) for repeat in repeats if repeat.difference]
    words = f"{len(repeats) - len(differences)} of {len(repeats)} ended in the same state"
    lines = (f'<p class="bad">{escape(name)}: {escape(difference)}</p>' for name, difference in differences)
    return f'<h2>Repeated runs</h2><div class="card"><p>{words}</p>{"".join(lines)}</div>'


def _table(heads: Sequence[tuple[str, str]], rows: Iterable[str]) -> str:
    """Return a table; heads are texts and the kinds of their columns."""
    head = "".join(f'<th class="{kind}">{name}</th>' for name, kind in heads)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _trial(summary: TrialSummary, points: Sequence[float]) -> str:
    outcomes = ", ".join(f"{count} {_outcome_words(name)}" for name, count in summary.outcomes.items())
    numbers = [f"{number:.4g}" for number in (summary.mean, summary.min, summary.max, summary.reachable)]
    numbers.insert(1, range_text(summary.mean_interval))
    cells = "".join(f'<td class="n">{number}</td>' for number in numbers)
    share = '<td class="n">-</td>'
    if summary.share is not None:
        share = f'<td class="n {_grade(summary.share)}">{summary.share:.0%}</td>'
    passed = "not judged"
    if summary.share is not None:
        passed = f"{summary.passed} of {summary.runs}, {range_text(summary.passed_interval, 100.0, ' %')}"
    name = escape(summary.trial).replace(".", ".<wbr>")  # a long key may go on in the next line
    return (
        f"<tr><td><b>{name}</b></td><td>{histogram(points, summary.reachable)}</td>{cells}"
        f'{share}<td class="n tight">{passed}</td>'
        f'<td class="tight">{escape(outcomes)}</td>'
        f'<td class="n">{summary.real_time_factor:.1f}</td></tr>'
    )


def _legend() -> str:
    marks = "".join(
        f'<span><svg viewBox="0 0 16 12"><rect class="{kind}" width="16" height="12" rx="2"/></svg>{words}</span>'
        for kind, words in _LEGEND
    )
    kit = '<svg viewBox="0 0 16 12"><path class="kit" d="M8 1l5 5l-5 5l-5 -5z"/></svg>'
    return f'<p class="key">{marks}<span>{kit}kit submitted, with its points</span></p>'


def _runs(results: Sequence[Result], threshold: Threshold | None, pictures: Mapping[str, bytes]) -> Iterator[str]:
    for number, result in enumerate(worst_first(results)):
        loses = not result.is_unjudged and (shortcoming(result, threshold) or result.share < 1.0)
        is_open = " open" if number < _OPEN and loses else ""
        inside = _inside(result, threshold, pictures.get(result.key, b""))
        yield f"<details{is_open}>{_head(result, threshold)}\n{inside}</details>"


def _head(result: Result, threshold: Threshold | None) -> str:
    kind = (
        "fair"
        if result.is_unjudged
        else "bad"
        if not result.is_done
        else "fair"
        if shortcoming(result, threshold)
        else "good"
    )
    meter = (
        f'<div class="meter"><i class="{_grade(result.share)}" style="width:{max(0.0, result.share):.1%}"></i></div>'
    )
    return (
        f"<summary><b>{escape(result.name)}</b>"
        f'<span class="badge {kind}">{escape(_outcome_words(result.outcome))}</span>'
        f"<span>{result.points:g} of {result.reachable:g}</span>{meter}"
        f'<span class="soft">{result.wall:.1f} s</span></summary>'
    )


def _inside(result: Result, threshold: Threshold | None, picture: bytes) -> str:
    parts = []
    reason = shortcoming(result, threshold)
    if reason:
        kind = "fair" if result.is_unjudged else "bad"
        parts.append(f'<p class="{kind}">{escape(reason)}</p>')
    if picture:
        source = f"data:image/png;base64,{base64.b64encode(picture).decode()}"
        parts.append(f'<img class="state" alt="The cell at the end of the run" src="{source}">')
    if result.timeline:
        parts.append(f'<div class="scroll">{timeline_picture(result.timeline)}</div>')
    parts += [_kit(order, kit) for order in result.score.get("orders", ()) for kit in order["kits"]]
    if result.log:
        parts.append(f"<h3>Last lines of the log</h3><pre>{escape(chr(10).join(result.log))}</pre>")
    ending = f"{result.ending}; {result.simulated:.1f} s simulated in {result.wall:.1f} s"
    state = f"; state <code>{escape(result.state_hash)}</code>" if result.state_hash else ""
    parts.append(f'<p class="soft">{escape(ending)}{state}</p>')
    if result.command:
        parts.append(f'<p class="soft">rerun: <code>{escape(result.command)}</code></p>')
    return f'<div class="inside">{"".join(parts)}</div>'


def _kit(order: Mapping[str, Any], kit: Mapping[str, Any]) -> str:
    words, _, more = kit_words(kit).partition(": ")
    title = f"<h3>{escape(order['order_id'])}, kit {escape(kit['kit_type'])}: {escape(words)}</h3><p>{escape(more)}</p>"
    heads = [("part", ""), ("present", "n"), ("pose", "n"), ("why", "")]
    extras = "".join(f"<p>extra: {escape(each['name'])} ({escape(each['reason'])})</p>" for each in kit["extras"])
    return f"{title}{_table(heads, map(_part, kit['parts']))}{extras}"


def _part(part: Mapping[str, Any]) -> str:
    earned, attainable = part["presence"] + part["pose"], part["reachable_presence"] + part["reachable_pose"]
    kind = "good" if earned >= attainable else "fair" if earned else "bad"
    cells = [(part["type"], ""), (f"{part['presence']:g}", "n"), (f"{part['pose']:g}", "n"), (part["sentence"], kind)]
    row = "".join(f'<td class="tight {kind}">{escape(text)}</td>' for text, kind in cells)
    return f"<tr>{row}</tr>"


def _outcome_words(outcome: str) -> str:
    return _SHORT.get(outcome) or (outcome.replace("_", " ") if outcome in OUTCOMES else outcome)


def _grade(share: float) -> str:
    return "good" if share >= 0.9 else "fair" if share >= 0.6 else "bad"
