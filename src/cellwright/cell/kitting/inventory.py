"""Inventory for kitting: names and types of parts, faults, storage units, drop regions and contents of trays.

A model in the cell is called `bin7|piston_rod_part_3` or `populate_conveyor|gear_part_clone_0`: origin, type and
number. Faults and camera frames use the name without its origin, kits the type alone.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellwright.config.trial.trial import DropRegion
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

# A number or a clone mark is cut off only if at least two characters are left before it. This is the competition's own
# rule: `a_2` is a type of its own.
_NUMBER = re.compile(r"(?<=..)_[0-9]+\Z", re.DOTALL)
_MIN_TYPE_LENGTH = 2
TrayContents: TypeAlias = tuple["TrayObject", ...]
"""The objects on one tray in the order of the tray's report, which is also the order of matching."""


def trimmed_name(model_name: str) -> str:
    """Return the name without its origin: `bin7|piston_rod_part_3` becomes `piston_rod_part_3`."""
    return model_name.rpartition("|")[2]


def part_type(model_name: str) -> str:
    """Return the type in a model name.

    Both `bin7|piston_rod_part_3` and `x|piston_rod_part_clone_0` have the type `piston_rod_part`. First the origin is
    removed, then a trailing `_<number>`, then everything from the last `_clone` on.
    """
    name = _NUMBER.sub("", trimmed_name(model_name))
    clone = name.rfind("_clone")
    return name[:clone] if clone >= _MIN_TYPE_LENGTH else name


class DropZones:
    """The drop regions of a trial, and the types that have been dropped already.

    A type is dropped once: after that all regions of the type are spent. Where regions of a type overlap, the first one
    in the file counts.
    """

    def __init__(self, regions: Iterable[DropRegion]) -> None:
        self.regions = tuple(regions)
        self._spent: set[str] = set()

    def drop(self, part_type: str, world_position: Vector3) -> DropRegion | None:
        """Return the region that takes a held part away, or None; the type is spent from then on.

        The regions are closed boxes.

        Args:
            part_type: type of the part in the gripper.
            world_position: of the part's origin, world frame [m].
        """
        if part_type in self._spent:
            return None
        for region in self.regions:
            if region.type == part_type and region.covers(world_position):
                self._spent.add(part_type)
                return region
        return None

    def reset(self) -> None:
        """Start a new trial: no type is spent."""
        self._spent.clear()

    def get_state(self) -> dict[str, Any]:
        """Return the spent types as JSON values."""
        return {"spent": sorted(self._spent)}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state that `get_state` returned.

        Raises:
            UnknownNameError: no region exists for a type.
        """
        types = {region.type for region in self.regions}
        for part_type in state["spent"]:
            if part_type not in types:
                raise UnknownNameError("type with a drop region", part_type, sorted(types))
        self._spent = set(state["spent"])


@dataclass(frozen=True, slots=True)
class TrayObject:
    """An object that touches a tray's plate or is locked to it.

    It has its full model name, and its type as kits name it. A faulty part earns nothing.
    """

    name: str
    type: str
    is_faulty: bool
    tray_T_object: Pose


def contents_to_json(contents: TrayContents) -> list[dict[str, Any]]:
    """Return a tray's contents as JSON values; positions [m], quaternions (w, x, y, z)."""
    return [
        {
            "name": each.name,
            "type": each.type,
            "is_faulty": each.is_faulty,
            "position": list(each.tray_T_object.position),
            "quaternion": list(each.tray_T_object.quaternion),
        }
        for each in contents
    ]


def contents_from_json(values: Iterable[Mapping[str, Any]]) -> TrayContents:
    """Return a tray's contents from the values that `contents_to_json` returned."""
    return tuple(
        TrayObject(
            each["name"], each["type"], each["is_faulty"], Pose(tuple(each["position"]), tuple(each["quaternion"]))
        )
        for each in values
    )
