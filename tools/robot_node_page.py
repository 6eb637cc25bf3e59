"""Topics of a robot's node as a table for people: `python -m tools.robot_node_page PAGE`.

The command replaces the table in the page, between two marks.
"""

from __future__ import annotations

import sys
from pathlib import Path

from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import Endpoint, EndpointKind
from cellwright.robot.interface import IO_TELEOP

BEGIN, END = "<!-- topics -->\n", "<!-- end of topics -->\n"

_HEAD = ("name", "type", "rate", "QoS in ROS 2", "available", "meaning", "origin")


def tables() -> str:
    """Return the node's published topics, its subscribed topics, and its services."""
    parts = []
    for title, kind, direction in (
        ("Published topics", EndpointKind.TOPIC, Direction.OUT),
        ("Subscribed topics", EndpointKind.TOPIC, Direction.IN),
        ("Services", EndpointKind.SERVICE, Direction.IN),
    ):
        rows = [row for row in IO_TELEOP if (row.kind, row.direction) == (kind, direction)]
        missing = (
            set()
            if direction is Direction.OUT
            else {"rate"}
            if kind is EndpointKind.TOPIC
            else {"rate", "QoS in ROS 2"}
        )
        columns = [column for column, name in enumerate(_HEAD) if name not in missing]
        lines = [[_HEAD[column] for column in columns], ["---" for _ in columns]]
        lines += [[_cells(row)[column] for column in columns] for row in rows]
        table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        parts.append(f"**{title}**\n\n{table}\n")
    return "\n".join(parts)


def renewed(page: str) -> str:
    """Return a page with the present tables."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{tables()}{END}{after}"


def _cells(row: Endpoint) -> tuple[str, ...]:
    rate = f"{row.rate_text}, latched" if row.latch else row.rate_text
    return (f"`{row.name}`", f"`{row.type}`", rate, row.qos.text, row.where.text, row.about, row.source)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(renewed(path.read_text(encoding="utf-8")), encoding="utf-8")
