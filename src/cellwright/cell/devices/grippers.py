"""Grippers of a cell: one for each arm that holds parts."""

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.devices.parts import Parts
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.model.arm import CUP_GEOM
from cellwright.config.trial.trial import Trial

Gripper: TypeAlias = VacuumGripper | FingerGripper
"""A gripper of any kind: `set_enabled`, `enabled`, `attached`, `part`, `lost_reason` and `on_change` are alike."""


def grippers_of(trial: Trial, parts: Parts) -> dict[str, Gripper]:
    """Return the grippers of a trial's arms, by the names of these, in the order of the arms."""
    found: dict[str, Gripper] = {**VacuumGripper.of(trial, parts), **FingerGripper.of(trial, parts)}
    return {arm.name: found[arm.name] for arm in trial.arms if arm.name in found}


def tool_points(model: Any, grippers: Iterable[Gripper], body_index: Callable[[int], int]) -> list[list[Any]]:
    """Return the body of each gripper and the point in its frame [m] that is at a part: cup, or middle between pads.

    Args:
        model: the engine's model.
        grippers: the grippers.
        body_index: maps a body id of the engine to another index; grippers for which that is 0 are left out.
    """
    found = []
    for each in grippers:
        arm = each.arm
        is_cup = isinstance(each, VacuumGripper)
        place = model.geom(arm.prefix + CUP_GEOM) if is_cup else model.site(arm.gripper_names.grasp)
        if body := body_index(int(place.bodyid[0])):
            found.append([body, place.pos.tolist()])
    return found
