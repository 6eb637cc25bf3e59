"""Forced drops: regions in which the gripper loses a part, once per type and trial."""

from collections.abc import Iterable, Mapping
from typing import Any

from cellwright.config.trial.trial import DropRegion
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Vector3


class DropZones:
    """The drop regions of a trial, and which types have been lost already.

    A type is lost once: after that all regions of the type are spent. Where regions of a type overlap, the one that
    was written first counts.
    """

    def __init__(self, regions: Iterable[DropRegion]) -> None:
        self.regions = tuple(regions)
        self._spent: set[str] = set()

    def is_armed(self, part_type: str) -> bool:
        """Whether a part of this type may still be lost somewhere; cheap, to be asked before poses are computed."""
        return part_type not in self._spent and any(region.type == part_type for region in self.regions)

    def drop(self, part_type: str, world_position: Vector3) -> DropRegion | None:
        """The region that takes a part away, or None; the type is spent from then on.

        Args:
            part_type: type of the part in the gripper.
            world_position: origin of the part in the world frame [m]. The regions are closed boxes.
        """
        if part_type in self._spent:
            return None
        for region in self.regions:
            if region.type == part_type and contains(region, world_position):
                self._spent.add(part_type)
                return region
        return None

    def reset(self) -> None:
        """A new trial: nothing has been lost yet."""
        self._spent.clear()

    def get_state(self) -> dict[str, Any]:
        """The types that are spent, as JSON values."""
        return {"spent": sorted(self._spent)}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned.

        Raises:
            UnknownNameError: a type of which there is no region here.
        """
        types = {region.type for region in self.regions}
        for part_type in state["spent"]:
            if part_type not in types:
                raise UnknownNameError("type with a drop region", part_type, sorted(types))
        self._spent = set(state["spent"])


def contains(region: DropRegion, world_position: Vector3) -> bool:
    """Whether a point of the world frame [m] lies in the region, its faces included."""
    return all(
        low <= value <= high for low, value, high in zip(region.lower, world_position, region.upper, strict=True)
    )
