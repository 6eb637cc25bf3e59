"""Clearance of the arm, against distances in the cell's own model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.clearance import (
    CLEARANCE,
    CUP_FACE,
    PLANNED_CLEARANCE,
    Clearance,
    Load,
    Obstacle,
    places_along,
)
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.ur10_on_rail import SHOULDER_OFFSET, station_posture
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.trial import Trial
from cellwright.motion import Joints, link_poses, tool_down
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.distances import LINKS, LinkDistances
from tests.clients.agents.kitter.places import ARM, clearance_of

PRESENT = Joints(0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
FLOOR_OF_BIN = 0.725
DISK = Catalogue().figures("disk_part")
HELD_DISK = Load(DISK, Pose((-DISK.grip[0], -DISK.grip[1], -DISK.top - CUP_FACE)))

turns = st.floats(-3.1, 3.1)
anywhere = st.builds(Joints, st.floats(-2.1, 2.1), turns, turns, turns, turns, turns, turns)
at_work = st.builds(
    Joints,
    st.floats(-2.1, 2.1),
    st.floats(0.0, 6.2),
    st.floats(-2.3, 0.2),
    st.floats(0.5, 2.8),
    st.floats(2.0, 5.0),
    st.floats(-1.8, -1.3),
    turns,
)


@pytest.fixture(scope="module")
def cell() -> Cell:
    """An arm, bins, belt and AGVs."""
    return Cell(Trial("", has_arm=True))


@pytest.fixture(scope="module")
def client(cell: Cell) -> Client:
    return Client(InProcess(cell, node="/agent"))


@pytest.fixture(scope="module")
def clearance(client: Client) -> Clearance:
    return clearance_of(client)


@pytest.fixture(scope="module")
def real(cell: Cell) -> LinkDistances:
    return LinkDistances(cell)


def over_bin(x: float, y: float, z: float) -> Joints:
    """Return joints with the cup's face at a place, facing down."""
    joints = station_posture(tool_down(x, y, z), y + SHOULDER_OFFSET, PRESENT)
    assert joints is not None
    return joints


@given(joints=st.one_of(anywhere, at_work))
@example(joints=PRESENT)
def test_clearance_finds_what_is_near_in_the_cell(clearance: Clearance, real: LinkDistances, joints: Joints) -> None:
    near = real.at(joints, CLEARANCE + 0.001)
    found = clearance.obstacle([joints])
    if found is None:
        assert min(near.values(), default=CLEARANCE) > CLEARANCE - 1e-4
    else:
        pair = found.moving, found.other
        distance = near.get(pair, near.get(pair[::-1]))
        assert distance is not None, f"{found}: it is not so"
        assert distance < CLEARANCE + 1e-4


def test_random_postures_are_both_free_and_not(clearance: Clearance) -> None:
    """So the test above sees either case."""
    random = np.random.default_rng(3)
    low, high = (-2.1, 0.0, -2.3, 0.5, 2.0, -1.8, -3.1), (2.1, 6.2, 0.2, 2.8, 5.0, -1.3, 3.1)
    found = [clearance.obstacle([random.uniform(low, high).tolist()]) for _ in range(200)]
    assert 40 < sum(each is None for each in found) < 160


def test_obstacle_says_what_would_come_near_to_what(clearance: Clearance) -> None:
    found = clearance.obstacle([over_bin(-0.3, 0.23, FLOOR_OF_BIN + 0.003)])
    assert found is not None
    assert (found.moving, found.other) == ("vacuum_gripper_link", "bin7")
    assert found.distance == pytest.approx(0.003, abs=1e-3)
    assert str(Obstacle(0.0031, "forearm_link", "bin8")) == "forearm_link would come within 3 mm of bin8"
    assert str(Obstacle(-0.2, "load", "agv1")) == "load would come within 0 mm of agv1"


def test_obstacle_anywhere_on_path_is_found(clearance: Clearance) -> None:
    free, blocked = over_bin(-0.3, 0.23, 0.95), over_bin(-0.3, 0.23, FLOOR_OF_BIN)
    assert clearance.obstacle([free, free]) is None
    assert clearance.obstacle([free, blocked, free]) is not None
    assert clearance.obstacle([]) is None


def test_distance_kept_is_as_wanted(clearance: Clearance) -> None:
    between = [over_bin(-0.3, 0.23, FLOOR_OF_BIN + (CLEARANCE + PLANNED_CLEARANCE) / 2)]
    assert clearance.obstacle(between) is None
    assert clearance.obstacle(between, least=PLANNED_CLEARANCE) is not None


def test_touching_cup_may_be_near_floor_but_not_near_wall(clearance: Clearance) -> None:
    on_floor, at_wall = over_bin(-0.3, 0.23, FLOOR_OF_BIN), over_bin(-0.3, 0.49, 0.76)
    assert clearance.obstacle([on_floor]) is not None
    assert clearance.obstacle([on_floor], touches=True) is None
    for touches in (False, True):
        found = clearance.obstacle([at_wall], touches=touches)
        assert found is not None
        assert (found.moving, found.other) == ("vacuum_gripper_link", "bin7")


def test_touching_arm_may_be_near_nothing(clearance: Clearance) -> None:
    found = clearance.obstacle([over_bin(-0.3, 0.5, 0.73)], touches=True)
    assert found is not None
    assert found.moving == "vacuum_gripper_link", "the nearest of several, beside the cup"


def test_load_counts_while_it_is_held(clearance: Clearance) -> None:
    low = [over_bin(-0.3, 0.23, FLOOR_OF_BIN + DISK.height + 0.005)]
    high = [over_bin(-0.3, 0.23, FLOOR_OF_BIN + DISK.height + 0.02)]
    for _ in range(2):
        found = clearance.obstacle(low, HELD_DISK)
        assert found is not None
        assert (found.moving, found.other) == ("load", "bin7")
        assert clearance.obstacle(low, HELD_DISK, touches=True) is None
        assert clearance.obstacle(high, HELD_DISK) is None
        assert clearance.obstacle(low) is None, "it was put down"


def test_load_is_where_cup_holds_it(clearance: Clearance) -> None:
    low = [over_bin(-0.3, 0.23, FLOOR_OF_BIN + DISK.height + 0.02)]
    lower = Load(DISK, Pose((0.0, 0.0, HELD_DISK.gripper_T_part.position[2] - 0.015)))
    assert clearance.obstacle(low, HELD_DISK) is None
    assert clearance.obstacle(low, lower) is not None
    assert clearance.obstacle(low, HELD_DISK) is None


def test_each_type_of_load_has_its_own_shape(clearance: Clearance) -> None:
    pulley = Catalogue().figures("pulley_part")
    held = Load(pulley, Pose((0.0, 0.0, -pulley.top - CUP_FACE)))
    middling = [over_bin(-0.3, 0.23, FLOOR_OF_BIN + (DISK.height + pulley.height) / 2)]
    assert clearance.obstacle(middling, HELD_DISK) is None
    assert clearance.obstacle(middling, held) is not None
    assert clearance.obstacle(middling, HELD_DISK) is None


def test_load_does_not_hit_what_holds_it(clearance: Clearance) -> None:
    assert clearance.obstacle([over_bin(-0.3, 0.23, 0.95)], HELD_DISK) is None


def test_load_that_reaches_the_arm_is_an_obstacle(clearance: Clearance) -> None:
    joints = over_bin(-0.3, 0.23, 1.1)
    links = link_poses(joints)
    at_elbow = Load(DISK, links["vacuum_gripper_link"].inverse() @ links["forearm_link"])
    found = clearance.obstacle([joints], at_elbow)
    assert found is not None
    assert "load" in (found.moving, found.other)
    assert {found.moving, found.other} <= {"load", *LINKS}


steps = st.lists(st.lists(st.floats(-0.5, 0.5), min_size=7, max_size=7), min_size=1, max_size=6)


@given(anywhere, steps)
def test_places_along_keep_ends_and_are_close(start: Joints, changes: list[list[float]]) -> None:
    path = [list(start)]
    for change in changes:
        path.append([at + by for at, by in zip(path[-1], change, strict=True)])
    found = places_along(path, ARM.figures.steps)
    assert found[0] == pytest.approx(path[0])
    assert found[-1] == pytest.approx(path[-1])
    largest = np.abs(np.diff(found, axis=0)).max(axis=0)
    assert largest[0] <= 0.05 + 1e-9, "a rail moves all of the arm"
    assert largest[1:4].max() <= 0.1 + 1e-9, "of these joints on the arm's length"
    assert largest[4:].max() <= 0.3 + 1e-9
    for place in found:
        assert distance_to(path, place) < 1e-9


def distance_to(path: Sequence[Sequence[float]], place: Any) -> float:
    """Return the distance of a place to the nearest straight part of a path."""
    found = []
    for begin, end in zip(np.array(path[:-1]), np.array(path[1:]), strict=True):
        way = end - begin
        length = float(way @ way)
        share = min(1.0, max(0.0, float((place - begin) @ way) / length)) if length else 0.0
        found.append(float(np.linalg.norm(place - begin - share * way)))
    return min(found)


def test_places_along_rest_are_its_ends() -> None:
    assert places_along([PRESENT, PRESENT], ARM.figures.steps).tolist() == [list(PRESENT)] * 2
    assert places_along([PRESENT], ARM.figures.steps).tolist() == [list(PRESENT)] * 2


def test_rail_goes_elsewhere_if_something_is_in_the_way(client: Client, real: LinkDistances) -> None:
    """At its usual place the forearm would hit the wall of the next bin."""
    blind, arm = KitterArm(client, client, ARM), KitterArm(client, client, ARM, clearance_of(client))
    above, goal, usual = tool_down(-0.3, 0.45, 0.95), tool_down(-0.3, 0.45, 0.745), ARM.rail_beside(-0.3, 0.45)
    unseen, clear = blind.clear_posture(above, goal, usual), arm.clear_posture(above, goal, usual)
    assert unseen is not None
    assert clear is not None
    assert unseen[0] == usual != clear[0]
    for rail, is_clear in ((usual, False), (clear[0], True)):
        joints = station_posture(goal, rail, PRESENT)
        assert joints is not None
        assert (min(real.at(joints, 0.05).values(), default=0.05) >= PLANNED_CLEARANCE - 1e-4) is is_clear


def test_rail_stays_at_usual_place_if_nothing_is_in_the_way(client: Client) -> None:
    arm = KitterArm(client, client, ARM, clearance_of(client))
    posture = arm.clear_posture(tool_down(-0.3, 0.23, 0.95), tool_down(-0.3, 0.23, 0.745), 0.4)
    assert posture is not None
    assert posture[0] == 0.4


def test_clear_posture_is_found_again_only_after_a_command(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    arm = KitterArm(client, client, ARM, clearance_of(client))
    find, found = arm._find_clear, 0

    def count(above: Pose, goal: Pose, rail: float) -> Any:
        nonlocal found
        found += 1
        return find(above, goal, rail)

    monkeypatch.setattr(arm, "_find_clear", count)
    asked = tool_down(-0.3, 0.23, 0.95), tool_down(-0.3, 0.23, 0.745), 0.4
    assert arm.clear_posture(*asked) == arm.clear_posture(*asked)
    assert found == 1
    arm.roll(0.1)
    arm.clear_posture(*asked)
    assert found == 2


def test_place_that_no_rail_reaches_has_none(client: Client) -> None:
    arm = KitterArm(client, client, ARM, clearance_of(client))
    in_wall = tool_down(-0.3, 0.55, 0.95), tool_down(-0.3, 0.55, 0.745)
    assert arm.clear_posture(*in_wall, ARM.rail_beside(-0.3, 0.55)) is None
    assert arm.clear_posture(tool_down(-1.3, 0.23, 0.95), tool_down(-1.3, 0.23, 0.745), 0.4) is None


def test_arm_does_not_move_into_obstacle(client: Client) -> None:
    arm = KitterArm(client, client, ARM, clearance_of(client))
    assert arm.travel(tool_down(-0.3, 0.49, 0.95), ARM.rail_beside(-0.3, 0.49))
    here, now = arm.joints, client.time
    arm.line(tool_down(-0.3, 0.49, 0.74), 0.3)
    assert client.time == now
    assert arm.joints == here
