"""Contacts between links of a robot."""

import mujoco
import numpy as np
import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Joint, JointType, Limits, Link
from cellwright.mechanism.shapes import joined_pairs
from cellwright.robot.model import build_robot
from cellwright.util.pose import Pose
from tests.cell.model.robots import of_joints

ROOM = Limits(-3.2, 3.2)
LENGTH = 0.3


def solid(name: str, radius: float = 0.05) -> Link:
    """Return a link with a ball at its far end, which touches no other link."""
    return Link(name, shapes=(ModelShape("sphere", (radius, 0.0, 0.0), Pose((0.0, 0.0, LENGTH))),))


def joint(parent: str, child: str, kind: JointType = JointType.REVOLUTE) -> Joint:
    return Joint(child, kind, parent, child, Pose((0.0, 0.0, LENGTH)), limits=ROOM)


CHAIN = (joint("a", "b"), joint("b", "c"), joint("c", "d"))


def touching(self_collision: bool, radius: float, posture: dict[str, float]) -> set[frozenset[str]]:
    """Return the pairs of bodies in contact, of a chain of four links with balls."""
    links = {name: solid(name, radius) for name in "abcd"}
    world = build_robot(of_joints(*CHAIN, links=links), self_collision=self_collision)
    data = mujoco.MjData(world.model)
    for name, value in posture.items():
        data.qpos[world.model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(world.model, data)
    bodies = world.model.geom_bodyid[data.contact.geom[: data.ncon]]
    return {frozenset(world.model.body(body).name for body in pair) for pair in np.atleast_2d(bodies) if len(pair)}


FOLDED = {"b": 2.0, "c": 2.0 * np.pi / 3, "d": 2.0 * np.pi / 3}


def test_links_do_not_touch_by_default() -> None:
    assert touching(False, 0.05, FOLDED) == set()


def test_unjoined_links_touch_with_self_collision() -> None:
    # a triangle: the balls of d and a are at one place
    assert touching(True, 0.05, FOLDED) == {frozenset("ad")}


def test_joined_links_never_touch() -> None:
    # each folded onto the link before
    assert touching(True, 0.05, {"b": np.pi, "c": np.pi, "d": np.pi}) == {frozenset("ac"), frozenset("bd")}


def test_links_overlapping_in_initial_posture_never_touch() -> None:
    # balls of 0.31 m overlap the next but one in the initial posture, and never count
    assert touching(True, 0.31, FOLDED) == {frozenset("ad")}


@pytest.mark.parametrize(
    ("joints", "moved", "pairs"),
    [
        (CHAIN, "bcd", {"ab", "bc", "cd"}),
        (CHAIN, "bd", {"ab", "ac", "bc", "bd", "cd"}),  # b and c are one
        (CHAIN, "", {"ab", "ac", "ad", "bc", "bd", "cd"}),
        ((joint("a", "b"), joint("a", "c"), joint("c", "d")), "bcd", {"ab", "ac", "cd"}),
    ],
)
def test_links_joined_by_fixed_joints_count_as_one(joints: tuple[Joint, ...], moved: str, pairs: set[str]) -> None:
    robot = of_joints(*joints).robot
    found = joined_pairs(robot, frozenset(moved), frozenset("abcd"))
    assert {"".join(sorted(pair)) for pair in found} == pairs
    assert len(found) == len(pairs)
    assert joined_pairs(robot, frozenset(moved), frozenset("a")) == []


def test_engine_stages_that_are_off_have_nothing_to_do() -> None:
    off = mujoco.mjtDisableBit
    alone, colliding = (build_robot(of_joints(*CHAIN), self_collision=asked).model for asked in (False, True))
    for stage in (off.mjDSBL_ACTUATION, off.mjDSBL_SPRING, off.mjDSBL_DAMPER):
        assert alone.opt.disableflags & stage
        assert colliding.opt.disableflags & stage
    assert alone.opt.disableflags & off.mjDSBL_CONTACT
    assert not colliding.opt.disableflags & off.mjDSBL_CONTACT
    for strength in (alone.actuator_gainprm, alone.actuator_biasprm, alone.dof_damping, alone.jnt_stiffness):
        assert not strength.any()
