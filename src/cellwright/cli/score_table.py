"""The score of a run as people read it, in 80 columns: what each ordered part earned, and why a point was lost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from cellwright.cli.document import best
from cellwright.description.trial import Trial
from cellwright.kitting.kit_score import BonusVerdict, KitScore, PartFinding, Verdict
from cellwright.kitting.matching import MAX_DISTANCE, MAX_YAW_DIFFERENCE, MIN_QUATERNION_DOT
from cellwright.kitting.scorer import GameScore, OrderScore
from cellwright.run import RunResult, versions

_NAME_WIDTH = 22  # leaves the table 80 columns wide with the longest type of part

REASONS: Mapping[str, str] = MappingProxyType(
    {
        Verdict.TOO_FAR: f"there, but more than {MAX_DISTANCE * 1e3:g} mm from its place",
        Verdict.TILTED: "in its place, but not the ordered side up "
        f"(more than {math.degrees(2 * math.acos(MIN_QUATERNION_DOT)):.0f} deg off)",
        Verdict.TURNED: "in its place, but turned by more than "
        f"{MAX_YAW_DIFFERENCE:g} rad ({math.degrees(MAX_YAW_DIFFERENCE):.1f} deg)",
        Verdict.FAULTY: "none but a faulty one, which does not count",
        Verdict.MISSING: "none on the tray when it was submitted",
        BonusVerdict.PARTS_SHORT: "an ordered part is not there, so there is no bonus",
        BonusVerdict.EXTRA_OBJECTS: "the tray holds more than was ordered, so there is no bonus",
    }
)
"""Why points were lost, in one sentence each."""


def show(console: Console, trial: Trial, result: RunResult) -> None:
    """Print what came of a run: the score, how it ended, and what it takes to get the same again."""
    for order in result.score.orders:
        for kit in order.kits:
            _show_kit(console, order, kit)
    console.print()
    for order_id in not_announced(trial, result.score):
        console.print(f"{order_id} was never announced", markup=False, soft_wrap=True)
    known = list(versions().items())
    lines = [
        ("outcome", str(result.outcome)),
        ("score", f"{result.score.total:g} of {best(trial):g} points"),
        ("simulated", f"{result.simulated:.1f} s in {result.wall:.1f} s: {result.real_time_factor:.1f} x real time"),
        ("state hash", result.state_hash),
        ("versions", ", ".join(f"{name} {version}" for name, version in known[:3])),
        ("", ", ".join(f"{name} {version}" for name, version in known[3:])),
        *((f"heard {count}", topic) for topic, count in sorted(result.heard.items())),
    ]
    for name, text in lines:
        note(console, name, text)


def note(console: Console, name: str, text: str) -> None:
    """Print a line of the summary."""
    console.print(f"{name:<10}  {text}", markup=False, soft_wrap=True)


def not_announced(trial: Trial, score: GameScore) -> list[str]:
    """Ids of the orders that never came up."""
    announced = {order.order_id for order in score.orders}
    return [order.order_id for order in trial.orders if order.order_id not in announced]


def table(kit: KitScore) -> Table:
    """A row for each ordered part, with what was found for it and its points."""
    result = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    result.add_column("part", no_wrap=True)
    result.add_column("found", no_wrap=True)
    for heading in ("off\nmm", "turn\ndeg", "there", "pose"):
        result.add_column(heading, justify="right")
    result.add_column("lost", no_wrap=True)
    for part in kit.parts:
        result.add_row(*_part_cells(part))
    return result


def reasons(kit: KitScore) -> Iterator[str]:
    """A sentence for each kind of loss in this kit."""
    found = [part.verdict for part in kit.parts if part.verdict is not Verdict.PLACED]
    for verdict in Verdict:
        if verdict in found:
            yield f"{verdict}: {REASONS[verdict]}"
    if kit.bonus is not None and kit.bonus is not BonusVerdict.EARNED:
        yield f"{kit.bonus}: {REASONS[kit.bonus]}"


def _show_kit(console: Console, order: OrderScore, kit: KitScore) -> None:
    title = Text(f"{order.order_id}, kit {kit.kit_type}: ")
    if not kit.is_submitted:
        console.print("\n", title + Text("not submitted, no points", style="bold"), sep="")
        return
    title += Text(f"{kit.total:g} of {kit.maximum:g} points", style="bold")
    console.print("\n", title, "\n", sep="")
    console.print(table(kit))
    for line in sums(kit):
        console.print(line, markup=False, soft_wrap=True)


def sums(kit: KitScore) -> Iterator[str]:
    """What stands below the table: sums, what was of no use, and why points were lost."""
    each = len(kit.parts)
    yield ""
    points = (("there", kit.part_presence), ("pose", kit.part_pose), ("bonus", kit.all_parts_bonus))
    yield ", ".join(f"{name} {earned:g} of {each}" for name, earned in points)
    for extra in kit.extras:
        yield f"  besides: {extra.name} ({extra.reason})"
    for line in reasons(kit):
        yield f"  {line}"


def _part_cells(part: PartFinding) -> list[str | Text]:
    lost = "" if part.verdict is Verdict.PLACED else str(part.verdict)
    points = [f"{part.presence:g}", f"{part.pose:g}"]
    if part.fit is None:
        return [part.type, "-", "", "", *points, lost]
    distance, turn = part.fit.distance * 1e3, math.degrees(part.fit.yaw_difference)
    return [part.type, _name(part.fit.object_name), f"{distance:.1f}", f"{turn:.1f}", *points, lost]


def _name(name: str) -> Text:
    """A model's name; a long one is broken behind what it came from."""
    return Text(name if len(name) <= _NAME_WIDTH else name.replace("|", "|\n"))
