"""The score of a run as people and as programs read it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from cellwright.description.trial import Trial
from cellwright.kitting.kit_score import BonusVerdict, KitScore, PartFinding
from cellwright.kitting.scorer import GameScore
from cellwright.run import RunResult, versions

_POINTS_A_PART = 3.0


def show(console: Console, trial: Trial, result: RunResult, min_score: float | None, pictures: Sequence[str]) -> None:
    """Print what came of a run: the score, how it ended, and what it takes to get the same again."""
    if result.score.orders:
        console.print()
        console.print(table(result.score, trial))
        console.print()
    lines = [
        ("outcome", str(result.outcome)),
        ("score", f"{result.score.total:g} of {best(trial):g}"),
        ("simulated", f"{result.simulated:.1f} s in {result.wall:.1f} s: {result.real_time_factor:.1f} x real time"),
        ("state hash", result.state_hash),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions().items())),
    ]
    if min_score is not None and result.score.total < min_score:
        lines.insert(2, ("", f"below the {min_score:g} that was asked for"))
    lines += [("heard", f"{count} on {topic}") for topic, count in sorted(result.heard.items())]
    lines += [("picture", path) for path in pictures]
    for name, text in lines:
        console.print(f"{name:<10}  {text}", markup=False, soft_wrap=True)


def table(score: GameScore, trial: Trial) -> Table:
    """A row for each ordered part: what was found and what it earned; kits and orders summed up."""
    result = Table(title="Score", title_justify="left", show_edge=False, pad_edge=False)
    for heading in ("kit", "part", "found"):
        result.add_column(heading)
    for heading in ("presence", "pose", "all parts", "points"):
        result.add_column(heading, justify="right")
    for order in score.orders:
        for kit in order.kits:
            _add_kit(result, kit)
    total = f"[bold]{score.total:g}[/] of {best(trial):g}"
    result.add_row("[bold]total[/]", "", "", "", "", "", total)
    return result


def best(trial: Trial) -> float:
    """The points of a perfect game: three for each ordered part."""
    return _POINTS_A_PART * sum(len(kit.objects) for order in trial.orders for kit in order.kits)


def document(score: GameScore, trial: Trial) -> dict[str, Any]:
    """The score as JSON values; lengths in m, angles in rad, times in s."""
    return {
        "total": score.total,
        "best": best(trial),
        "part_travel_time": score.part_travel_time / 1e9,
        "orders": [
            {
                "order_id": order.order_id,
                "total": order.total,
                "complete": order.is_complete,
                "time_taken": order.time_taken / 1e9,
                "kits": [_kit(kit) for kit in order.kits],
            }
            for order in score.orders
        ],
    }


def _add_kit(result: Table, kit: KitScore) -> None:
    if not kit.is_submitted:
        result.add_row(kit.kit_type, "", "not submitted", "", "", "", f"{kit.total:g}", end_section=True)
        return
    for number, part in enumerate(kit.parts):
        name = kit.kit_type if number == 0 else ""
        result.add_row(name, part.type, found(part), f"{part.presence:g}", f"{part.pose:g}", "", "")
    for extra in kit.extras:
        result.add_row("", extra.type, f"extra: {extra.name} ({extra.reason})", "", "", "", "")
    bonus = {None: "", BonusVerdict.EARNED: "complete"}.get(kit.bonus, f"no bonus: {kit.bonus}")
    sums = [f"{points:g}" for points in (kit.part_presence, kit.part_pose, kit.all_parts_bonus, kit.total)]
    result.add_row("", "", bonus, *sums, end_section=True)


def found(part: PartFinding) -> str:
    """What was found for an ordered part, with its distance and turn from where it should lie."""
    if part.fit is None:
        return str(part.verdict)
    fit = part.fit
    return (
        f"{part.verdict}: {fit.object_name}, off by {fit.distance * 1e3:.1f} mm, "
        f"{math.degrees(fit.yaw_difference):.1f} deg"
    )


def _kit(kit: KitScore) -> dict[str, Any]:
    return {
        "kit_type": kit.kit_type,
        "submitted": kit.is_submitted,
        "total": kit.total,
        "part_presence": kit.part_presence,
        "all_parts_bonus": kit.all_parts_bonus,
        "part_pose": kit.part_pose,
        "bonus": None if kit.bonus is None else str(kit.bonus),
        "parts": [_part(part) for part in kit.parts],
        "extras": [{"name": each.name, "type": each.type, "reason": str(each.reason)} for each in kit.extras],
    }


def _part(part: PartFinding) -> dict[str, Any]:
    fit = part.fit
    return {
        "type": part.type,
        "verdict": str(part.verdict),
        "presence": part.presence,
        "pose": part.pose,
        "object": None if fit is None else fit.object_name,
        "distance": None if fit is None else fit.distance,
        "yaw_difference": None if fit is None else fit.yaw_difference,
        "quaternion_dot": None if fit is None else fit.quaternion_dot,
    }
