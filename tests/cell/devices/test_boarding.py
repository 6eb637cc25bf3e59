"""Boarding, in a parallel gripper: what its weld holds becomes a passenger, what its pads hold does not."""

from types import SimpleNamespace
from typing import Any

import pytest

from cellwright.cell.devices.collision_culling import CollisionCulling
from cellwright.config.gripper import Holding, ParallelGripperSettings
from tests.mechanism.gripper_rig import NAMES, PART, Load, Rig

UP = (0.0, 0.0, 1.0)


def culled(holds: Holding) -> tuple[Rig, CollisionCulling]:
    """A rig with culling."""
    rig = Rig(ParallelGripperSettings(holds=holds), Load(), UP)
    no_overlaps: Any = SimpleNamespace(bodies=frozenset())
    culling = CollisionCulling((), no_overlaps)
    rig.simulation.add(culling)
    rig.simulation.reset()
    return rig, culling


def test_part_on_a_weld_becomes_a_passenger_of_the_palm() -> None:
    rig, culling = culled("weld")
    rig.grip()
    rig.drive(0.1)
    assert culling.passengers == {rig.part: rig.simulation.model.body(NAMES.palm).id}
    assert rig.simulation.data.ncon == 0
    assert rig.gripper.part == PART


def test_passenger_is_put_down_when_the_fingers_open() -> None:
    rig, culling = culled("weld")
    rig.run(0.1)
    before = rig.height
    rig.grip()
    rig.drive(0.1)
    rig.gripper.open()
    rig.run(0.02)
    assert not culling.passengers
    rig.run(1.0)
    assert rig.height == pytest.approx(before, abs=1e-3)


def test_part_that_friction_holds_keeps_its_contacts() -> None:
    rig, culling = culled("friction")
    rig.grip()
    rig.drive(0.1)
    rig.run(0.5)
    assert not culling.passengers
    assert rig.part not in culling.closed
    assert rig.simulation.data.ncon == 8
    assert rig.gripper.part == PART


@pytest.mark.parametrize("holds", ["weld", "friction"])
def test_sleeping_part_between_the_fingers_is_gripped(holds: Holding) -> None:
    rig, _ = culled(holds)
    rig.run(2.0)
    tree = int(rig.simulation.model.body_treeid[rig.part])
    assert rig.simulation.data.tree_asleep[tree] >= 0
    rig.grip()
    assert rig.gripper.part == PART


def test_fingers_never_sleep() -> None:
    rig, _ = culled("weld")
    rig.run(2.0)
    rig.grip()
    finger = int(rig.simulation.model.body(NAMES.fingers[0]).id)
    assert rig.simulation.data.tree_asleep[rig.simulation.model.body_treeid[finger]] < 0
