"""Reader of the tool of an arm: a suction cup, a parallel gripper, or none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from cellwright.config.gripper import BOUNDS, HOLDINGS, Pad, ParallelGripperSettings
from cellwright.config.layout.arms import Tool, ToolKind, grasp_distance
from cellwright.config.parsing.quantities import quantities, quantity
from cellwright.config.parsing.reader import Keys, Reader, one_of, section
from cellwright.config.parsing.schema import accepts
from cellwright.config.parsing.tree import YamlNode

PAD = Keys(
    optional={
        "size": quantities((2,), quantity(*BOUNDS["pad.size"]), "[across, along]"),
        "friction": quantity(*BOUNDS["pad.friction"]),
    },
    strict="entry",
    texts="cell-pad",
)
"""Keys of the pads of a parallel gripper."""

TOOL = Keys(
    {"kind": one_of(get_args(ToolKind), "kind of tool")},
    {
        "length": quantity(0.01, 1.0, "m"),
        **{name: quantity(*BOUNDS[name]) for name in ("opening", "force", "speed")},
        "pad": section(PAD, Pad),
        "holds": one_of(HOLDINGS, "way to hold a part"),
    },
    strict="entry",
    texts="cell-tool",
)
"""Keys of an arm's tool."""

_ENTRIES: Mapping[str, tuple[str, ...]] = {
    "vacuum": ("length",),
    "parallel": ("length", "opening", "force", "speed", "pad", "holds"),
    "none": (),
}
"""Entries of each kind of tool."""


@accepts(TOOL.schema)
def read_tool(reader: Reader, node: YamlNode) -> Tool | None:
    """Return the tool of an arm, or None after errors."""
    table = reader.table(node)
    values: dict[str, Any] = TOOL.read(table, reader) if table else {}
    if table is None or not TOOL.complete(values):
        return None
    kind: ToolKind = values.pop("kind")
    length = values.pop("length", None)
    strangers = [name for name in table.entries if name in TOOL.optional and name not in _ENTRIES[kind]]
    for name in strangers:
        of = " or ".join(other for other, known in _ENTRIES.items() if name in known)
        reader.problems.error(table.entries[name], f"a tool of kind {kind} has none; leave it out, or use kind: {of}")
    if strangers:
        return None
    if kind != "parallel":
        return Tool(kind) if length is None else Tool(kind, length)
    fingers = ParallelGripperSettings(**values)
    least = grasp_distance(fingers)
    if length is not None and length < least:
        message = f"must be at least {least:g} m, the gripper's own length (got {length:g})"
        reader.problems.error(table.entries["length"], message)
        return None
    return Tool(kind, least if length is None else length, fingers)
