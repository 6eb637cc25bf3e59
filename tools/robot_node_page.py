"""The topics of a robot's node as a table for people: `python -m tools.robot_node_page PAGE`.

The table stands in the page between two marks, and is written there anew.
"""

from __future__ import annotations

import sys
from pathlib import Path

from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import Kind, Row
from cellwright.robot.interface.rows import IO_TELEOP

BEGIN, END = "<!-- topics -->\n", "<!-- end of topics -->\n"

_HEAD = ("name", "type", "rate", "there", "what it is", "known from")


def tables() -> str:
    """What the node says, what it hears, and its services."""
    parts = []
    for title, kind, direction in (
        ("It says", Kind.TOPIC, Direction.OUT),
        ("It hears", Kind.TOPIC, Direction.IN),
        ("Services", Kind.SERVICE, Direction.IN),
    ):
        rows = [row for row in IO_TELEOP if (row.kind, row.direction) == (kind, direction)]
        columns = [column for column in range(len(_HEAD)) if column != 2 or direction is Direction.OUT]
        lines = [[_HEAD[column] for column in columns], ["---" for _ in columns]]
        lines += [[_cells(row)[column] for column in columns] for row in rows]
        table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        parts.append(f"**{title}**\n\n{table}\n")
    return "\n".join(parts)


def renewed(page: str) -> str:
    """A page with the tables as they are now."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{tables()}{END}{after}"


def _cells(row: Row) -> tuple[str, ...]:
    rate = f"{row.rate_text}, latched" if row.latch else row.rate_text
    return (f"`{row.name}`", f"`{row.type}`", rate, row.where.value, row.about, row.source)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(renewed(path.read_text(encoding="utf-8")), encoding="utf-8")
