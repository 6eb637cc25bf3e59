"""Page of the interface, for people: `python -m tools.contract_page > docs/contract.md`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence

from cellwright.cell.interface.rows import GEAR, PICTURES
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import CompetitionMode, Endpoint, EndpointKind
from cellwright.middleware.messages import md5
from cellwright.middleware.messages.types import short_name, sources

INTRODUCTION = """\
# The contract of the kit-building cell

Every name that the cell answers to, in a program's own process as over ROS 1. The names, types, rates and latches are
those of the 2017 competition. Made from the table in `src/cellwright/cell/interface/rows.py` by
`python -m tools.contract_page > docs/contract.md`; a test holds the two together.

- Rates are in simulation time, and "each step" means the simulation's own step (2 ms unless the file says otherwise).
- A latched topic gives a late listener its newest message.
- The quality of service (QoS) is in the terms of ROS 2, for a bridge to come. ROS 1 has none.
- `{sensor}` stands for the name of a sensor in the file, `{n}` for the number of an AGV, 1 or 2.
- In messages a quaternion is (x, y, z, w).
- In competition mode some names act otherwise, as their last column says. Listening never changes what the cell does,
  not even to a topic that is silent then.
- The original simulator's own services under `/gazebo` are no part of the contract.
"""

CAMERAS = """\
## Cameras that take pictures

They were not there in 2017, and are only where a file asks for them: [Cameras](cameras.md). None is latched; each
comes at its camera's own rate, and only while somebody listens.
"""


def markdown(rows: Iterable[Endpoint]) -> str:
    """Return rows as tables: published topics, subscribed topics, actions and services."""
    kinds: Sequence[tuple[str, EndpointKind, Direction]] = (
        ("Topics from the cell", EndpointKind.TOPIC, Direction.OUT),
        ("Topics to the cell", EndpointKind.TOPIC, Direction.IN),
        ("Actions", EndpointKind.ACTION, Direction.IN),
        ("Services", EndpointKind.SERVICE, Direction.IN),
    )
    all_rows = tuple(rows)
    parts = []
    for title, kind, direction in kinds:
        chosen = [row for row in all_rows if (row.kind, row.direction) == (kind, direction)]
        if chosen:
            parts.append(f"## {title}\n\n{_table(chosen, rated=direction is Direction.OUT)}")
    return "\n".join(parts)


def types_table() -> str:
    """Return the types that the project defines itself, with their ROS 1 checksums."""
    lines = ["| type | | MD5 |", "|---|---|---|"]
    for name, text in sources().items():
        about = text.splitlines()[0].removeprefix("# ")
        lines.append(f"| `{short_name(name)}` | {about} | `{md5(name)}` |")
    return "\n".join(lines) + "\n"


def contract_page() -> str:
    """Return the whole page."""
    types = (
        "## Types of its own\n\n"
        "Standard types come from ROS itself; these are defined in `src/cellwright/messages/definitions`. "
        "The checksum is ROS 1's.\n"
    )
    cameras = f"{CAMERAS}\n{_table(PICTURES, rated=False)}"
    return "\n".join((INTRODUCTION, markdown(GEAR), cameras, types, types_table()))


def _table(rows: Sequence[Endpoint], *, rated: bool) -> str:
    columns = ["name", "type", "rate", "latched", "QoS in ROS 2", "there", "what it is", "in competition mode"]
    missing = set() if rated else {"rate", "latched"}
    if rows[0].kind is not EndpointKind.TOPIC:
        missing.add("QoS in ROS 2")
    head = [column for column in columns if column not in missing]
    lines = [_line(head), "|" + "---|" * len(head)]
    lines += [_line([_cells(row)[column] for column in head]) for row in rows]
    return "\n".join(lines) + "\n"


def _cells(row: Endpoint) -> dict[str, str]:
    return {
        "name": f"`{row.name}`",
        "type": f"`{row.type}`",
        "rate": row.rate_text,
        "latched": "yes" if row.latch else "",
        "QoS in ROS 2": row.qos.text,
        "there": row.where.value,
        "what it is": row.about,
        "in competition mode": "" if row.competition is CompetitionMode.SAME else row.competition.value,
    }


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    sys.stdout.write(contract_page())
