"""The entries `parts` and `furniture` of Cellwright's own section: models of somebody's own. Every slip is an error."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from cellwright.config.layout import PART_TYPES
from cellwright.config.models.model import Furniture, Model
from cellwright.config.models.reader import only, reach, read_model
from cellwright.config.parsing import evaluated
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Items, Node, Table, described
from cellwright.util.pose import Pose

LEAST_MASS, MOST_MASS = 1e-3, 100.0
"""Bounds of a part's mass [kg]."""
FARTHEST_REACH = 0.22
"""How far a part may reach from its origin [m]: parts that wait stand 0.45 m apart."""
MOST_FURNITURE = 200
MOST_TYPES = 200
"""Most part types of somebody's own."""

_RESERVED = frozenset({"agv1", "agv2", "kit_tray", "tray"})
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]+", re.ASCII)
_NUMBERED = re.compile(r".*(_\d+|_clone.*)")  # these tails are taken off a model's name to get its type


@dataclass(frozen=True, slots=True)
class OwnModels:
    """Part types by name, and furniture."""

    parts: Mapping[str, Model] = field(default_factory=dict)
    furniture: tuple[Furniture, ...] = ()


def read_own_models(node: Node | None, reader: Reader) -> OwnModels:
    """What the section `cellwright` has under `parts` and `furniture`."""
    if not isinstance(node, Table):
        return OwnModels()
    parts, furniture = node.get("parts"), node.get("furniture")
    return OwnModels(_parts(parts, reader) if parts else {}, _furniture(furniture, reader) if furniture else ())


def _parts(node: Node, reader: Reader) -> dict[str, Model]:
    table = reader.table(node)
    found: dict[str, Model] = {}
    if table and len(table.entries) > MOST_TYPES:
        reader.problems.error(node, f"{len(table.entries)} part types; at most {MOST_TYPES} are read")
        return {}
    for entry in table.entries.values() if table else ():
        name = reader.text_key(entry)
        body = reader.table(entry.value)
        if name is None or body is None:
            continue
        _check_name(name, entry, reader)
        only(body, ("mass", "color", "shapes", "file"), reader)
        model = read_model(body, entry, reader)
        if model is None:
            continue
        if model.mjcf is None and not any(shape.is_touched for shape in model.shapes):
            reader.problems.error(entry, "nothing of it can be touched: it would fall through the floor")
        elif model.mjcf is None and model.mass is None:
            reader.problems.error(entry, "the required entry 'mass' is missing, and its file has none [kg]")
        elif model.mass is not None and not LEAST_MASS <= model.mass <= MOST_MASS:
            message = f"a mass of {model.mass:g} kg; a part has {LEAST_MASS:g} to {MOST_MASS:g} kg"
            reader.problems.error(body.entries.get("mass", entry), message)
        elif (farthest := max(map(reach, model.shapes), default=0.0)) > FARTHEST_REACH:
            message = f"reaches {farthest:.2f} m from its origin; a part keeps within {FARTHEST_REACH:g} m"
            reader.problems.error(entry, message)
        else:
            found[name] = model
    return found


def _check_name(name: str, entry: Entry, reader: Reader) -> None:
    if not _NAME.fullmatch(name) or _NUMBERED.fullmatch(name):
        message = "a part type is named with letters, digits and _, and ends neither in _ and a number nor in _clone"
        reader.problems.error(entry, message)
    elif name in PART_TYPES or name in _RESERVED:
        reader.problems.error(entry, f"there is a model {name!r} already; give yours another name")


def _furniture(node: Node, reader: Reader) -> tuple[Furniture, ...]:
    if not isinstance(node, Items):
        reader.problems.error(node, f"must be a list, not {described(node)}")
        return ()
    if len(node.items) > MOST_FURNITURE:
        reader.problems.error(node, f"more than {MOST_FURNITURE} pieces")
        return ()
    found: dict[str, Furniture] = {}
    for item in node.items:
        evaluated.check(item, reader.problems)
        table = reader.table(item)
        if table is None:
            continue
        only(table, ("name", "pose", "color", "shapes", "file"), reader)
        name_node = reader.required(table, "name")
        name = reader.name(name_node) if name_node else None
        model = read_model(table, table, reader)
        pose_node = table.get("pose")
        placement = reader.placement(pose_node) if pose_node else None
        if name is None or name_node is None or model is None:
            continue
        if name in found or "|" in name:
            what = "there is another piece of this name" if name in found else "a name has no |"
            reader.problems.error(name_node, what)
        found[name] = Furniture(name, model, placement.pose if placement else Pose())
    return tuple(found.values())
