"""Names in a cell: what they may consist of, and which ones the cell has for something else."""

import re
from collections.abc import Collection
from typing import Final

from cellwright.config.arm import ARM_FRAMES
from cellwright.config.layout.basing import PACKAGED
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.schema import accepts
from cellwright.config.parsing.tree import Entry, YamlNode

MAX_LENGTH: Final = 60
"""Maximum length of a name [characters]."""
PLACE_SECTIONS = ("bins", "belts", "carriers", "trays")
"""Sections of places that parts can be put."""
NAMED_SECTIONS = (*PLACE_SECTIONS, "structure", "arms", "robots")
"""Sections whose names share the topics, frames and bodies of the cell."""
RESERVED = frozenset(
    {
        *("world", "floor", "map", "base", "tool0", "ee_link", "linear_arm", *ARM_FRAMES),
        *("gripper", "conveyor", "conveyor_belt", "population", "deletion_wall", "shelf", "tray", "kit_tray"),
        *("competition", "competition_state", "current_score", "joint_states", "orders", "trays", "layout"),
        *("start_competition", "end_competition", "material_locations", "submit_tray", "controller_manager"),
    }
)
"""Names of bodies, frames, devices, topics and services that every cell has."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_TRAY = re.compile(r"(kit_tray|quality_control_sensor)_\d+")
_OF_BELT = ("conveyor_{}", "population_{}")
"""Names of the body and the devices of a belt, by its name."""
_ARM = "arm"
"""Name of the arm's device, which an arm may have, and nothing else."""


@accepts({"type": "string", "pattern": f"^{_NAME.pattern}$"})
def read_namespace(reader: Reader, node: YamlNode) -> str | None:
    """Return a namespace: of the topics of an arm, below `/ariac`, or of a robot."""
    name = reader.name(node)
    if name is not None and (not _NAME.fullmatch(name) or len(name) > MAX_LENGTH or name in RESERVED):
        reader.problems.error(node, f"must be letters, digits and _, and no name of the cell's own (got {name!r})")
        return None
    return name


class NameCheck:
    """Check of the names of a cell.

    Args:
        reader: receives every mistake.
        types: part types, whose names nothing else may have.
    """

    def __init__(self, reader: Reader, types: Collection[str]) -> None:
        self._reader = reader
        self._types = types
        self._owners: dict[str, Entry] = {}

    def admit(self, entry: Entry, name: str, section: str) -> None:
        """Note a name of a section, or report why it cannot be used."""
        reason = self._reason(entry, name, section)
        if reason:
            self._reader.problems.error(entry, reason)
            return
        self._owners[name] = entry
        for made in (pattern.format(name) for pattern in _OF_BELT if section == "belts"):
            if made in self._owners:
                owner = self._owners[made]
                self._reader.problems.error(
                    entry, f"{owner.key} has the name of its body or parts, {made!r}; choose another"
                )
            self._owners.setdefault(made, entry)

    def _reason(self, entry: Entry, name: str, section: str) -> str:
        if not _NAME.fullmatch(name) or len(name) > MAX_LENGTH:
            return (
                f"a name becomes topics and frames; use at most {MAX_LENGTH} letters, digits and _, with a letter first"
            )
        if name in self._owners:
            owner = self._owners[name]
            return f"{owner.key} has this name ({owner.place}); choose another"
        if name in self._types and entry.place.path != PACKAGED:
            return "a part type has this name; choose another"
        if name in RESERVED or _TRAY.fullmatch(name) or (name == _ARM and section != "arms"):
            return f"the cell has something else called {name!r}; choose another name"
        return ""
