"""The score of a run as people read it, in 80 columns: what each ordered part earned, and why a point was lost."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from textwrap import wrap

from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.segment import Segments
from rich.table import Table
from rich.text import Text

from cellwright.cell.kitting.score.evidence import (
    NOT_ANNOUNCED,
    NOT_SUBMITTED,
    REASONS,
    Evidence,
    KitEvidence,
    PartEvidence,
)
from cellwright.cell.kitting.score.kit_score import BonusVerdict, Verdict
from cellwright.cell.kitting.score.trial_score import TrialScore
from cellwright.cli.lines import note
from cellwright.engine.clock import seconds
from cellwright.running.run import RunResult, versions

_MOST_COLLISIONS = 5
_WIDEST = 10_000  # columns
_TYPE_WIDTH, _NAME_WIDTH = 15, 25  # of part types and model names; they leave the table 80 columns wide


def show(console: Console, result: RunResult, final: TrialScore | None = None) -> None:
    """Print what came of a run: the score, how it ended, and what it takes to get the same again.

    Args:
        console: where to print.
        result: what came of it.
        final: the score of the trial as in the finals, if averages are known.
    """
    found, could = result.evidence, result.evidence.reach
    for order in found.orders:
        for kit in order.kits:
            show_kit(console, order.score.order_id, kit)
    console.print()
    known = list(versions().items())
    lines = [
        ("outcome", str(result.outcome)),
        ("score", f"{found.total:g} of {found.reach.maximum:g} points"),
        (
            "reachable",
            "" if could.total == could.maximum else f"{could.total:g} of {could.maximum:g}: see out of reach",
        ),
        *_times(found),
        ("sensors", f"cost {found.system_cost:g} $"),
        *(("finals", line) for line in _final(final)),
        *(("collision", collision.sentence()) for collision in result.collisions[:_MOST_COLLISIONS]),
        ("", f"and {more} more collisions" if (more := len(result.collisions) - _MOST_COLLISIONS) > 0 else ""),
        ("simulated", f"{result.simulated:.1f} s in {result.wall:.1f} s: {result.real_time_factor:.1f} x real time"),
        ("state hash", result.state_hash),
        ("versions", ", ".join(f"{name} {version}" for name, version in known[:3])),
        ("", ", ".join(f"{name} {version}" for name, version in known[3:])),
        *((f"heard {count}", topic) for topic, count in sorted(result.heard.items())),
    ]
    for name, text in lines:
        if text:
            note(console, name, text)


def table(kit: KitEvidence) -> Table:
    """A row for each ordered part, with what was found for it and its points."""
    result = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    result.add_column("part", no_wrap=True)
    result.add_column("found", no_wrap=True)
    rows = [_part_cells(part) for part in kit.parts]
    for place, heading in enumerate(("off mm", "turn mrad", "there", "pose"), 2):
        words = [*heading.split(), *(str(row[place]) for row in rows)]
        result.add_column(heading, justify="right", min_width=max(map(len, words)))  # only the heading is broken
    result.add_column("lost", no_wrap=True)
    for row in rows:
        result.add_row(*row)
    return result


def show_table(console: Console, kit: KitEvidence) -> None:
    """Print the table of a kit; it is wider than the console where a word of a name would have to be cut."""
    rows = table(kit)
    needed = Measurement.get(console, console.options.update(max_width=_WIDEST), rows).minimum
    options = console.options.update(width=max(console.width, needed))
    console.print(Segments(console.render(rows, options)), soft_wrap=True, end="")


def reasons(kit: KitEvidence) -> Iterator[str]:
    """A sentence for each kind of loss in this kit."""
    found = {part.cause for part in kit.parts}
    for cause in REASONS:
        if cause in found:
            yield f"{cause}: {REASONS[cause]}"
            if cause == Verdict.MISSING:
                yield from fates(kit)
    if kit.score.bonus is not None and kit.score.bonus is not BonusVerdict.EARNED:
        yield f"{kit.score.bonus}: {REASONS[kit.score.bonus]}"
    if summary := kit.reach.summary():
        yield f"out of reach: {summary}"


def fates(kit: KitEvidence) -> Iterator[str]:
    """What became of the missing parts, where that is known; indented, below the reason."""
    known = Counter((part.reach.type, part.fate.sentence()) for part in kit.parts if part.fate is not None)
    for (kind, sentence), count in known.items():
        yield f"  {kind}{f' ({count})' if count > 1 else ''}: {sentence}"


def sums(kit: KitEvidence) -> Iterator[str]:
    """What the parts of a kit add up to, and what was lost."""
    score, each = kit.score, len(kit.parts)
    yield ""
    if score.is_submitted:
        points = (("there", score.part_presence), ("pose", score.part_pose), ("bonus", score.all_parts_bonus))
        yield ", ".join(f"{name} {earned:g} of {each}" for name, earned in points)
    for extra in score.extras:
        yield f"  besides: {extra.name} ({extra.reason})"
    for line in reasons(kit):
        indent = line[: len(line) - len(line.lstrip())] + "  "
        yield from wrap(
            line.lstrip(),
            80,
            initial_indent=indent,
            subsequent_indent=indent + "  ",
            break_long_words=False,
            break_on_hyphens=False,
        )


def show_kit(console: Console, order_id: str, kit: KitEvidence) -> None:
    """Print what a kit earned: its name, its table, and why points were lost."""
    title = Text(f"{order_id}, kit {kit.score.kit_type}: ")
    if not kit.score.is_submitted:
        why = NOT_ANNOUNCED if kit.parts and kit.parts[0].cause == NOT_ANNOUNCED else NOT_SUBMITTED
        title += Text(f"{why}, no points", style="bold")
    else:
        title += Text(f"{kit.score.total:g} of {kit.reach.maximum:g} points", style="bold")
    console.print("\n", title, "\n", sep="", soft_wrap=True)
    show_table(console, kit)
    for line in sums(kit):
        console.print(line, markup=False, soft_wrap=True)


def _times(found: Evidence) -> Iterator[tuple[str, str]]:
    for order in found.orders:
        if order.is_announced:
            end = "" if order.score.is_complete else ", not complete"
            yield "time", f"{order.score.order_id} {seconds(order.score.time_taken):.1f} s{end}"
    carried = f"parts carried for {seconds(found.part_travel_time):.1f} s"
    yield "", f"game {seconds(found.process_time):.1f} s, {carried}"


def _final(score: TrialScore | None) -> Iterator[str]:
    if score is None:
        return
    terms = [f"cost {score.cost_points:.2f} (factor {score.cost_factor:.2f})"]
    terms += [f"{order.order_id} {order.efficiency_points:.2f} (time {order.efficiency:.2f})" for order in score.orders]
    yield f"{score.total:.2f} = {' + '.join(terms)}"


def _part_cells(part: PartEvidence) -> list[str | Text]:
    kind = _broken(part.reach.type, _TYPE_WIDTH)
    fit = None if part.finding is None else part.finding.fit
    lost = "" if part.cause == Verdict.PLACED else part.cause
    points = [f"{part.presence:g}", f"{part.pose:g}"]
    if fit is None:
        return [kind, "-", "", "", *points, lost]
    off, turned = f"{fit.distance * 1e3:.1f}", f"{fit.yaw_difference * 1e3:.0f}"
    return [kind, _broken(fit.object_name, _NAME_WIDTH), off, turned, *points, lost]


def _broken(name: str, width: int) -> Text:
    """A name in lines of a width where its words allow it: broken behind what it came from, then behind `_`."""
    lines: list[str] = []
    for piece in [name] if len(name) <= width else re.split(r"(?<=\|)", name):
        line = ""
        for word in re.split(r"(?<=_)", piece):
            if line and len(line) + len(word) > width:
                lines.append(line)
                line = ""
            line += word
        lines.append(line)
    return Text("\n".join(filter(None, lines)))
