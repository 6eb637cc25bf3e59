"""Turning a part over by its side, with the arm of a real cell."""

import math
from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.kits import find_turning_spot
from cellwright.clients.agents.kitter.motion import at_height, facing_down
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator, beside, pose_on_tray, raised, side_grip_pose
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.trial import KitObject, Trial
from cellwright.motion import face
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM, HALF, STATIONS, TRAY_SURFACE, WORKPLACE, clearance_of
from tests.support.cells import on_tray

KINDS = Catalogue()
PULLEY = KINDS.figures("pulley_part")


class Scene:
    """A pulley on a tray, and the arm of the agent."""

    def __init__(self, number: int, tray_T_part: Pose, *, has_part: bool = True) -> None:
        parts = on_tray(KitObject("pulley_part", tray_T_part), number=number) if has_part else ()
        self.cell = Cell(Trial("", has_arm=True, bin_parts=parts))
        client = Client(InProcess(self.cell, node="/agent"))
        client.start_competition()
        client.sleep(0.5)
        arm = KitterArm(client, client, ARM, clearance_of(client))
        self.station = STATIONS[number]
        self.hand = Manipulator(client, arm, KINDS, WORKPLACE)
        self.lying = pose_on_tray(self.station, PULLEY, tray_T_part, drop=0.0)
        above = at_height(pose_on_tray(self.station, PULLEY, tray_T_part), 1.0)
        assert arm.travel(facing_down(above), self.station.rail)

    def can_turn_over(self, direction: float) -> bool:
        return self.hand.can_turn_over("pulley_part", self.lying, direction, self.station.rail)

    def turn_over(self, direction: float, on_release: Callable[[], None] = lambda: None) -> bool:
        return self.hand.turn_over("pulley_part", self.lying, direction, self.station.rail, on_release)

    def side_up(self) -> tuple[Pose, bool]:
        """Return the true pose of the pulley in the world, by the side that is up, and whether it is its other side."""
        (part,) = self.cell.parts.all
        self.cell.simulation.refresh()
        return KINDS.side_up("pulley_part", self.cell.parts.pose(part))


def turning_spot(number: int, tray_T_goal: Pose) -> tuple[Scene, float]:
    """Return a scene with a pulley where the agent would turn it over, and the cup's direction in the world [rad]."""
    scene = Scene(number, Pose(), has_part=False)

    def can_turn_over(tray_T_part: Pose, direction: float) -> bool:
        scene.lying = pose_on_tray(scene.station, PULLEY, tray_T_part, drop=0.0)
        return scene.can_turn_over(scene.station.world_T_tray.yaw + direction)

    spot = find_turning_spot(PULLEY, tray_T_goal, HALF, (), (), can_turn_over)
    assert spot is not None
    assert spot.direction is not None
    return Scene(number, spot.tray_T_part), scene.station.world_T_tray.yaw + spot.direction


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize(
    ("x", "y", "yaw"),
    [
        (0.0, 0.0, 0.4),
        (0.1, 0.15, -2.0),
        (0.05, 0.1, 1.0),
        (-0.07, 0.044, 0.5),
        (-0.13, -0.12, 0.0),
        (-0.1, -0.19, 2.9),
    ],
)
def test_part_is_turned_over_where_it_lies(number: int, x: float, y: float, yaw: float) -> None:
    """At some of these places the part would swing against the forearm, from other directions."""
    scene, direction = turning_spot(number, Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw)))
    released: list[float] = []
    assert scene.turn_over(direction, lambda: released.append(scene.cell.simulation.time))
    assert len(released) == 1
    pose, is_turned = scene.side_up()
    assert is_turned
    assert math.dist(pose.position[:2], scene.lying.position[:2]) < 0.012
    assert pose.position[2] == pytest.approx(TRAY_SURFACE, abs=0.003)
    on_tray = scene.station.world_T_tray.inverse() @ pose
    assert math.remainder(on_tray.yaw - yaw, 2 * math.pi) == pytest.approx(0.0, abs=0.05)


def test_part_that_would_swing_against_forearm_cannot_be_turned_over() -> None:
    scene = Scene(2, Pose.from_rpy((-0.07, 0.044, 0.0), (0.0, 0.0, -1.285)))
    assert not scene.can_turn_over(7 * math.pi / 8)


@pytest.mark.slow
def test_part_turned_over_is_taken_by_its_other_side() -> None:
    scene, direction = turning_spot(1, Pose())
    assert scene.turn_over(direction)
    pose, is_turned = scene.side_up()
    held = scene.hand.from_rest("pulley_part", pose, scene.station.rail, is_turned=is_turned)
    assert held is not None
    assert held.is_turned
    goal = pose_on_tray(scene.station, PULLEY, Pose.from_rpy((0.1, -0.1, 0.0), (0.0, 0.0, 0.5)))
    assert scene.hand.put_down(held, goal, scene.station.rail)
    pose, is_turned = scene.side_up()
    assert is_turned
    assert math.dist(pose.position[:2], goal.position[:2]) < 0.005
    assert math.remainder(pose.yaw - goal.yaw, 2 * math.pi) == pytest.approx(0.0, abs=0.03)


@pytest.mark.slow
def test_part_that_is_not_there_is_not_turned_over() -> None:
    _, direction = turning_spot(1, Pose())
    assert not Scene(1, Pose(), has_part=False).turn_over(direction)


def test_part_out_of_reach_cannot_be_turned_over() -> None:
    scene = Scene(1, Pose())
    far = pose_on_tray(STATIONS[2], PULLEY, Pose(), drop=0.0)
    assert not scene.hand.can_turn_over("pulley_part", far, 0.0, scene.station.rail)
    now = scene.cell.simulation.time
    assert not scene.hand.turn_over("pulley_part", far, 0.0, scene.station.rail)
    assert scene.cell.simulation.time == now


def test_side_grip_has_cup_on_side_and_hand_above_surface() -> None:
    part = Pose.from_rpy((0.3, 3.15, TRAY_SURFACE), (0.0, 0.0, 0.4))
    gripper = side_grip_pose(PULLEY, part, math.pi / 2)
    x, y, z = face(gripper)
    assert (x, y) == pytest.approx((0.3, 3.15 - PULLEY.side))
    assert TRAY_SURFACE + 0.05 < z < TRAY_SURFACE + PULLEY.height, "the cup's radius is 50 mm"
    back = beside(gripper, 0.04).position
    assert back == pytest.approx((gripper.position[0], gripper.position[1] - 0.04, z))
    assert raised(gripper, 0.25).position[2] == pytest.approx(z + 0.25)
