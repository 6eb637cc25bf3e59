"""Report of an evaluation: one HTML file with its pictures, the worst runs first."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cellwright.running.evaluation.outputs.drawings import histogram, timeline_picture
from cellwright.running.evaluation.outputs.html import document, escape, table
from cellwright.running.evaluation.outputs.sweep_picture import STYLE as SWEEP_STYLE
from cellwright.running.evaluation.outputs.sweep_picture import sweep_picture
from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss, loss_counts
from cellwright.running.evaluation.results.result import OUTCOMES, Result
from cellwright.running.evaluation.results.summary import (
    Repeat,
    Threshold,
    TrialSummary,
    are_tasks,
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

_OPEN = 3  # runs that the page shows opened, if they lost points
_SHORT = {"memory_limit": "memory", "log_limit": "log", "died": "died", "gave_up": "gave up"}
_LEGEND = (
    ("order", "order, until complete"),
    ("open", "order, never complete"),
    ("held", "a part in the gripper"),
    ("delivering", "AGV delivering"),
    ("preparing_to_deliver", "AGV preparing or returning"),
)


def report(
    results: Sequence[Result],
    threshold: Threshold | None,
    repeats: Sequence[Repeat] = (),
    pictures: Mapping[str, bytes] | None = None,
    lost: Sequence[InfrastructureLoss] = (),
) -> str:
    """Return the page; `pictures` are PNG files by the keys of their results. Runs that are `lost` count nowhere."""
    agents = ", ".join(sorted({result.agent for result in results})) or "no agent"
    body = [
        f"<h1>{escape(agents)}</h1>",
        f'<p class="soft">{_subtitle(results, threshold)}</p>',
        f'<div class="tiles">{"".join(_tiles(results, threshold))}</div>',
        sweep_picture(summarize(results)),
        "<h2>Trials</h2>",
        _trials(results, threshold, lost),
        _losses(lost),
        _measures(results),
        _repeats(repeats),
        "<h2>Runs, worst first</h2>",
        _legend(),
        *_runs(results, threshold, pictures or {}),
        f'<p class="soft">{_trust(results)}</p>',
    ]
    return document(f"{agents}: evaluation", "\n".join(body), SWEEP_STYLE)


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
    words = "success rate" if are_tasks(results) else "of the attainable points"
    yield _tile(percent, with_interval(words, share_interval(results)), grade)
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


def _trials(results: Sequence[Result], threshold: Threshold | None, lost: Sequence[InfrastructureLoss]) -> str:
    heads = [("trial", ""), ("scores", ""), ("mean", "n"), ("95 %", "n"), ("min", "n"), ("max", "n")]
    heads += [("attainable", "n"), ("share", "n"), ("passed, 95 %", "n"), ("outcomes", ""), ("x real time", "n")]
    summaries = summarize(results, threshold)
    rows = [_trial(each, [r.points for r in results if r.trial == each.trial]) for each in summaries]
    rows += [_lost_row(trial, count, len(heads)) for trial, count in loss_counts(lost).items()]
    return f'<div class="card">{table(heads, rows)}</div>'


def _lost_row(trial: str, count: int, columns: int) -> str:
    words = f"{_count(count, 'run')} lost to the infrastructure, not counted"
    return f'<tr><td><b>{escape(trial)}</b></td><td class="soft" colspan="{columns - 1}">{words}</td></tr>'


def _losses(lost: Sequence[InfrastructureLoss]) -> str:
    if not lost:
        return ""
    lines = "".join(f'<p class="soft">{escape(each.line)}</p>' for each in lost)
    return f'<h2>Lost to the infrastructure</h2><div class="card">{lines}</div>'


def _measures(results: Sequence[Result]) -> str:
    rows = measure_rows(summarize(results))
    if not rows:
        return ""
    heads = [("trial", ""), ("figure", ""), ("mean", "n"), ("95 %", "n"), ("spread", "n")]
    cells = [
        [f'<td class="{kind}">{escape(text)}</td>' for text, (_, kind) in zip(row, heads, strict=True)] for row in rows
    ]
    lines = (f"<tr>{''.join(row)}</tr>" for row in cells)
    return f'<h2>Time and placement</h2><div class="card">{table(heads, lines)}</div>'


def _repeats(repeats: Sequence[Repeat]) -> str:
    if not repeats:
        return ""
    differences = [(repeat.first.name, repeat.difference) for repeat in repeats if repeat.difference]
    words = f"{len(repeats) - len(differences)} of {len(repeats)} ended in the same state"
    lines = (f'<p class="bad">{escape(name)}: {escape(difference)}</p>' for name, difference in differences)
    return f'<h2>Repeated runs</h2><div class="card"><p>{words}</p>{"".join(lines)}</div>'


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
    # a long key may go on in the next line
    name = escape(summary.trial).replace(".", ".<wbr>")
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
    is_fair = result.is_unjudged or shortcoming(result, threshold)
    kind = "bad" if not (result.is_done or result.is_unjudged) else "fair" if is_fair else "good"
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
    return f"{title}{table(heads, map(_part, kit['parts']))}{extras}"


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
