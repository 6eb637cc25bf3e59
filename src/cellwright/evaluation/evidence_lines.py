"""What earned and what lost each point of a result, in plain lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from cellwright.evaluation.result import Result


def evidence_lines(result: Result) -> Iterator[str]:
    """How a run ended and what it earned; a line for each ordered part and for each object that was of no use."""
    yield f"{result.ending}: {result.points:g} of {result.best:g} points"
    for order in result.score.get("orders", ()):
        for kit in order["kits"]:
            yield f"{order['order_id']}, kit {kit['kit_type']}: {kit_words(kit)}"
            for part in kit["parts"]:
                yield f"  {part['presence'] + part['pose']:g} of 2  {part['type']}: {part_words(part)}"
            for extra in kit["extras"]:
                yield f"  besides: {extra['name']} ({extra['reason']})"


def kit_words(kit: Mapping[str, Any]) -> str:
    """The sums of a kit."""
    if not kit["submitted"]:
        return "never submitted, no points"
    count = len(kit["parts"])
    bonus = "" if kit["bonus"] == "earned" else f" ({kit['bonus']})"
    return (
        f"{kit['total']:g} of {3 * count} points: there {kit['part_presence']:g} of {count}, "
        f"pose {kit['part_pose']:g} of {count}, bonus {kit['all_parts_bonus']:g} of {count}{bonus}"
    )


def part_words(part: Mapping[str, Any]) -> str:
    """What became of an ordered part."""
    if part["object"] is None:
        return str(part["verdict"])
    off, turn = part["distance"] * 1e3, math.degrees(part["yaw_difference"])
    return f"{part['verdict']}: {part['object']}, {off:.1f} mm off, turned {turn:.1f} deg"
