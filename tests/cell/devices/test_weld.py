"""Welds of the engine, in the running cell."""

import numpy as np
import pytest

from cellwright.mechanism.welds import engage_weld
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor, named, one_of_each

GEAR = named("gear_part")


@pytest.fixture(scope="module")
def shared() -> Floor:
    return Floor(one_of_each(has_arm=False))


@pytest.mark.parametrize("first", [True, False])
def test_weld_holds_part_at_pose_given_from_either_body(floor: Floor, first: bool) -> None:
    """The tray comes first in its weld; in the part's frame the pose is the inverse one."""
    part = floor.part(GEAR)
    tray = floor.cell.trays[1]
    tray_T_part = Pose.from_rpy((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
    floor.place(GEAR, tray.world_T_tray @ tray_T_part)
    if first:
        engage_weld(floor.simulation, part.locks[1], floor.model.body(tray.link).id, tray_T_part)
    else:
        engage_weld(floor.simulation, part.locks[1], part.body, tray_T_part.inverse())
    floor.run(1.0)
    held = tray.world_T_tray.inverse() @ floor.pose(GEAR)
    assert held.position == pytest.approx(tray_T_part.position, abs=0.05 * MM)
    assert np.abs(np.dot(held.quaternion, tray_T_part.quaternion)) == pytest.approx(1.0, abs=1e-6)


def test_weld_wakes_sleeping_part(floor: Floor) -> None:
    part = floor.part(GEAR)
    tray = floor.cell.trays[1]
    floor.run(1.0)
    assert floor.asleep(part.body)
    x, y, z = floor.pose(GEAR).position
    raised = Pose((x, y, z + 0.01))
    engage_weld(floor.simulation, part.locks[1], floor.model.body(tray.link).id, tray.world_T_tray.inverse() @ raised)
    floor.run(0.5)
    assert floor.pose(GEAR).position == pytest.approx(raised.position, abs=0.1 * MM)
