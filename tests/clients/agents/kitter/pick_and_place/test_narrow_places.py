"""Parts in the corners of bins, where the arm has little room, in a real cell."""

import math

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Held, Manipulator
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.distances import LINKS, LinkDistances
from tests.clients.agents.kitter.places import ARM, WORKPLACE, clearance_of

ROD = "piston_rod_part"


def rod(x: float, y: float, yaw: float) -> Pose:
    return Pose.from_rpy((x, y, 0.725), (0.0, 0.0, yaw))


def taken(world_T_part: Pose, *others: Pose) -> tuple[Held | None, float, bool]:
    """Let the arm take a rod out of bin 7, beside others.

    Returns:
        The rod on the cup, the least distance of the links, without the cup, on the way [m], and whether the arm said
        before that the rod is in reach.
    """
    parts = (Part(f"bin7|{ROD}_{number}", ROD, pose) for number, pose in enumerate((world_T_part, *others), start=1))
    cell = Cell(Trial("", has_arm=True, bin_parts=tuple(parts)))
    client = Client(InProcess(cell, node="/agent"))
    client.start_competition()
    client.sleep(0.5)
    hand = Manipulator(client, KitterArm(client, client, ARM, clearance_of(client)), Catalogue(), WORKPLACE)
    distances, nearest = LinkDistances(cell, LINKS[:-1]), [0.02]
    cell.simulation.watch("links", None, lambda _index: nearest.extend(distances.now(0.02).values()))
    rail = ARM.rail_beside(*world_T_part.position[:2])
    is_in_reach = hand.is_in_reach(ROD, world_T_part, rail)
    neighbours = [disc for pose in others for disc in Catalogue().figures(ROD).covers(pose)]
    return hand.from_rest(ROD, world_T_part, rail, neighbours=neighbours), min(nearest), is_in_reach


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world_T_part", "grip"),
    [
        (rod(-0.3, 0.23, 0.0), (0.0, 0.04)),  # in the middle
        (rod(-0.3, 0.46, math.pi / 2), (0.0, 0.0)),
        (rod(-0.3, 0.5, math.pi), (0.0, 0.09)),
    ],
)
def test_rod_is_taken_by_the_grip_that_has_room(world_T_part: Pose, grip: tuple[float, float]) -> None:
    held, nearest, is_in_reach = taken(world_T_part)
    assert is_in_reach
    assert held is not None
    x, y, _ = held.gripper_T_part.inverse().position
    assert (x, y) == pytest.approx(grip, abs=0.006)
    assert nearest >= 0.008


@pytest.mark.slow
def test_rod_without_room_is_out_of_reach_and_not_touched() -> None:
    held, nearest, is_in_reach = taken(rod(-0.3, 0.53, math.pi / 2))
    assert not is_in_reach
    assert held is None
    assert nearest == 0.02


@pytest.mark.slow
def test_cup_keeps_off_a_neighbour_that_it_might_hold() -> None:
    held, _, _ = taken(rod(-0.3, 0.23, 0.0), rod(-0.266, 0.42, math.pi))
    assert held is not None
    x, y, _ = held.gripper_T_part.inverse().position
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.006)
