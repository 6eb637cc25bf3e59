"""Aids of an operator."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.operator.aids import (
    HOVER,
    PRESS,
    SLOW,
    BeltAid,
    PartSnap,
    SeenPart,
    outward_down,
    snap_below,
)
from cellwright.clients.agents.operator.tool_arms import AGAINST, OperatedArm, operated_arms
from cellwright.clients.client.client import Client
from cellwright.config.layout.gear2017 import gear2017
from cellwright.motion.paths import angle_between
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3
from tests.cell.robot_cells import tandem_cell
from tests.support.cells import ARM_ONLY

DOWN = (0.0, 0.0, -1.0)
ABOVE = Pose((1.0, 2.0, 1.0))
angles = st.floats(-3.1, 3.1)


class Seen:
    """Surroundings with given parts, and belts at half speed."""

    def __init__(self, *parts: SeenPart) -> None:
        self.seen = list(parts)

    def parts(self) -> Sequence[SeenPart]:
        return self.seen

    def belts(self) -> Mapping[str, Vector3]:
        return {"belt": (0.0, -0.1, 0.0)}


def gear(x: float = 1.0, y: float = 2.0, z: float = 0.75, speed: float = 0.0, name: str = "gear_1") -> SeenPart:
    return SeenPart(name, "gear_part", Pose((x, y, z)), (0.0, -speed, 0.0))


@pytest.fixture(scope="module")
def arm() -> OperatedArm:
    return operated_arms(Client.in_process(Cell(ARM_ONLY)))[0]


@given(roll=angles, pitch=angles, yaw=angles)
def test_upright_tool_points_down_by_the_smallest_turn(roll: float, pitch: float, yaw: float) -> None:
    pose = Pose.from_rpy((0.1, 0.2, 0.3), (roll, pitch, yaw))
    found = outward_down(pose, AGAINST)
    assert found.position == pose.position
    assert found.rotate(AGAINST) == pytest.approx(DOWN, abs=1e-6)
    tilt = math.acos(max(-1.0, min(1.0, -pose.rotate(AGAINST)[2])))
    assert angle_between(pose, found) == pytest.approx(tilt, abs=1e-5)


def test_snap_takes_the_nearest_part_below(arm: OperatedArm) -> None:
    seen = Seen(gear(1.15, name="far"), gear(1.05, name="near"), gear(1.0, z=1.2, name="above"), gear(3.0, name="off"))
    assert snap_below(arm, ABOVE, seen, Catalogue(), lambda: False).name == "near"


def test_snap_goes_over_the_part_then_slowly_down(arm: OperatedArm) -> None:
    snap = PartSnap(arm, "gear_1", Seen(gear()), Catalogue(), lambda: False)
    over, most = snap.goal(ABOVE, ABOVE) or (Pose(), 0.0)
    assert most == 1.0
    top = 0.75 + Catalogue().figures("gear_part").top
    assert over.position == pytest.approx((1.0, 2.0, top + 0.005 + HOVER))
    on, most = snap.goal(over, over) or (Pose(), 0.0)
    assert on.position[2] == pytest.approx(top + 0.005 - PRESS)
    assert most == SLOW


def test_snap_is_commanded_ahead_of_a_part_that_moves(arm: OperatedArm) -> None:
    snap = PartSnap(arm, "gear_1", Seen(gear(speed=0.2)), Catalogue(), lambda: False)
    behind = Pose((1.0, 2.02, 1.0))
    for _ in range(200):
        found = snap.goal(ABOVE, behind)
    assert found is not None
    assert found[0].position[1] == pytest.approx(1.98, abs=1e-3)


def test_snap_ends_when_the_part_is_held_or_gone(arm: OperatedArm) -> None:
    seen = Seen(gear())
    assert PartSnap(arm, "gear_1", seen, Catalogue(), lambda: True).goal(ABOVE, ABOVE) is None
    seen.seen.clear()
    assert PartSnap(arm, "gear_1", seen, Catalogue(), lambda: False).goal(ABOVE, ABOVE) is None


def test_snap_without_what_it_needs_is_refused(arm: OperatedArm) -> None:
    with pytest.raises(UsageError, match=r"no part within 0\.2 m below"):
        snap_below(arm, ABOVE, Seen(gear(2.0)), Catalogue(), lambda: False)
    with pytest.raises(UsageError, match="run it with --operator"):
        snap_below(arm, ABOVE, None, Catalogue(), lambda: False)
    with pytest.raises(UsageError, match="holds a part"):
        snap_below(arm, ABOVE, Seen(gear()), Catalogue(), lambda: True)
    strange = SeenPart("block", "block_part", gear().world_T_part, (0.0, 0.0, 0.0))
    with pytest.raises(UsageError, match="block: its model is unknown"):
        snap_below(arm, ABOVE, Seen(strange), Catalogue(), lambda: False)
    robot = operated_arms(Client.in_process(Cell(tandem_cell())))[0]
    with pytest.raises(UsageError, match="tandem/right has no suction cup"):
        snap_below(robot, ABOVE, Seen(gear()), Catalogue(), lambda: False)


def test_belt_below_has_its_present_speed() -> None:
    (belt,) = gear2017().belts
    x, y, _ = belt.centre.position
    over = Pose((x, y, belt.surface + 0.2))
    assert BeltAid((belt,), Seen()).velocity(over) == (0.0, -0.1, 0.0)
    assert BeltAid((belt,), None).velocity(over) == pytest.approx(tuple(belt.speed * each for each in belt.direction))
    for beside in (Pose((x + 5.0, y, belt.surface + 0.2)), Pose((x, y, belt.surface + 2.0))):
        assert BeltAid((belt,), Seen()).velocity(beside) == (0.0, 0.0, 0.0)
