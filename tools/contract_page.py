"""Page of the interface, for people: `python -m tools.contract_page > docs/contract.md`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence

from cellwright.cell.interface.rows import GEAR, IN_COMPETITION, PICTURES
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import Endpoint, EndpointKind
from cellwright.middleware.messages import TYPES, short_name

INTRODUCTION = """\
# The contract of the kit-building cell

Which topics, services and actions does a cell have? The tables below list all of them. `cellwright serve lesson` offers
them over a socket, and with `--ros1` over ROS 1. Names, types, rates and latches
under `/ariac` are those of the 2017 competition; rows under `/cellwright` are additions.

| convention | meaning |
|---|---|
| rate | in simulation time; "each step" is the step of the simulation, 2 ms by default |
| latched | a late subscriber gets the newest message |
| QoS | quality of service in ROS 2's terms, for a future bridge; ROS 1 has none |
| `{sensor}` | the name of a sensor in the file |
| `{agv}`, `{tray}`, `{belt}` | the name in the layout of an AGV, `agv1` or `agv2`, of a fixed tray or of a belt |
| `{n}` | the number of the tray: 1 and 2 on the AGVs |
| quaternion | (x, y, z, w) in messages |
| in competition mode | how the entry differs in competition mode |

A subscription never changes what the cell does, even for a topic that is silent in competition mode. The original
simulator's own services under `/gazebo` are not part of the contract.

`python -m tools.contract_page > docs/contract.md` writes this page from the table in
`src/cellwright/cell/interface/rows.py`. A test compares the two.
"""

CAMERAS = """\
## Cameras that take pictures

The 2017 competition had no such cameras; a cell has them only if its file contains them: [Cameras](cameras.md). They
publish at their own rate, unlatched, while they have a subscriber.
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
    lines = ["| type | meaning | MD5 |", "|---|---|---|"]
    for name, text in TYPES.sources.items():
        about = text.splitlines()[0].removeprefix("# ")
        lines.append(f"| `{short_name(name)}` | {about} | `{TYPES.md5(name)}` |")
    return "\n".join(lines) + "\n"


def contract_page() -> str:
    """Return the whole page."""
    types = (
        "## Message types\n\n"
        "`src/cellwright/middleware/messages/definitions` defines these types. All others "
        "are\nstandard types of ROS. The checksums are ROS 1's.\n"
    )
    cameras = f"{CAMERAS}\n{_table(PICTURES, rated=False)}"
    return "\n".join((INTRODUCTION, markdown(GEAR), cameras, types, types_table()))


def _table(rows: Sequence[Endpoint], *, rated: bool) -> str:
    columns = ["name", "type", "rate", "latched", "QoS in ROS 2", "available", "meaning", "in competition mode"]
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
        "available": row.where.text,
        "meaning": row.about,
        "in competition mode": IN_COMPETITION[row.name].value if row.name in IN_COMPETITION else "",
    }


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    sys.stdout.write(contract_page())
