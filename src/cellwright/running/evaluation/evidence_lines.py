"""What earned and what lost each point of a result, in plain lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cellwright.running.evaluation.result import Result


def evidence_lines(result: Result) -> Iterator[str]:
    """How a run ended and what it earned; a line for each ordered part and for each object that was of no use."""
    yield f"{result.ending}: {result.points:g} of {result.reachable:g} points"
    for order in result.score.get("orders", ()):
        for kit in order["kits"]:
            yield f"{order['order_id']}, kit {kit['kit_type']}: {kit_words(kit)}"
            for part in kit["parts"]:
                yield f"  {part['presence'] + part['pose']:g} of 2  {part['type']}: {part['sentence']}"
            for extra in kit["extras"]:
                yield f"  besides: {extra['name']} ({extra['reason']})"


def kit_words(kit: Mapping[str, Any]) -> str:
    """The sums of a kit."""
    count = len(kit["parts"])
    words = f"{kit['total']:g} of {kit['reachable']:g} points"
    if kit["reachable"] < kit["best"]:
        words += f" within reach, {kit['best']:g} on paper"
    if kit["submitted"]:
        words += f": there {kit['part_presence']:g} of {count}, pose {kit['part_pose']:g} of {count}, "
        words += f"bonus {kit['all_parts_bonus']:g} of {count} ({kit['bonus_reason']})"
    else:
        words += f": {kit['bonus_reason']}"
    return words
