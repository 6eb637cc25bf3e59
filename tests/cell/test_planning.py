"""The arm as MoveIt plans for it, against the cell's model: collisions, home posture, limits and names."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import SubElement, fromstring, tostring

import mujoco
import numpy as np
import pytest

from cellwright.cell.controllers import TRAJECTORIES
from cellwright.cell.model.build import build_world
from cellwright.cell.model.solids import solids
from cellwright.cell.planning import planned_arm
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import INITIAL_POSITIONS, UR10
from cellwright.engine.link_collisions import CLEARANCE, Reason, unchecked_pairs
from cellwright.middleware.ros2.packages.moveit import srdf
from tests.middleware.ros2.packages.test_moveit import chain, check_srdf

pytestmark = pytest.mark.slow

Pair = tuple[str, str]


class Planned:
    """The arm as a planner has it: the URDF's collision shapes, among the solids of a cell."""

    def __init__(self, *, margin: float) -> None:
        arm = planned_arm()
        root = fromstring(arm.urdf)
        SubElement(SubElement(root, "mujoco"), "compiler", fusestatic="false", discardvisual="true")
        spec = mujoco.MjSpec.from_string(tostring(root, encoding="unicode"))
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
        links = {body.name for body in spec.bodies}
        for shape in solids(build_world(Trial("", has_arm=True)))["world"]:
            if shape["body"] == "world" or shape["body"] not in links:
                kind = getattr(mujoco.mjtGeom, f"mjGEOM_{shape['type'].upper()}")
                size = [*shape["size"], 0.0, 0.0, 0.0][:3] if shape["size"] else [0.0, 0.0, 0.1]
                spec.worldbody.add_geom(type=kind, size=size, pos=shape["position"], quat=shape["quaternion"])
        for geom in spec.geoms:
            geom.margin = margin / 2  # margins of both shapes add up
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        self.range = self.model.jnt_range.T

    def touching(self, posture: Any) -> Iterator[Pair]:
        """Yield pairs of bodies nearer to each other than the margin; the cell's solids are of the world."""
        self.data.qpos[:] = posture
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        for contact in self.data.contact[: self.data.ncon]:
            one, other = sorted(int(self.model.geom_bodyid[geom]) for geom in contact.geom)
            yield self.model.body(one).name, self.model.body(other).name

    def home(self) -> Any:
        posture = np.zeros(self.model.nq)
        for name, position in planned_arm().home.items():
            posture[self.model.joint(name).qposadr[0]] = position
        return posture


def test_names_of_srdf_are_those_of_the_description() -> None:
    arm = planned_arm()
    semantic = check_srdf(srdf(arm), arm.urdf)
    chains = {group.attrib["name"]: group.find("chain") for group in semantic.findall("group")}
    joints = {
        name: tuple(chain(arm.urdf, each.attrib["base_link"], each.attrib["tip_link"]))
        for name, each in chains.items()
        if each is not None
    }
    assert joints == {"arm_on_rail": ARM_JOINTS, "arm": ARM_JOINTS[1:]}


def test_action_is_that_of_the_controller() -> None:
    assert planned_arm().action == f"/{TRAJECTORIES}/follow_joint_trajectory"


def test_no_pair_is_unchecked_that_touches_in_some_postures() -> None:
    planned = Planned(margin=0.0)
    unchecked = unchecked_pairs(planned_arm().urdf)
    random = np.random.default_rng(99)
    counts = dict.fromkeys(unchecked, 0)
    samples = 2000
    for _ in range(samples):
        for pair in {pair for pair in planned.touching(random.uniform(*planned.range)) if pair in counts}:
            counts[pair] += 1
    assert {counts[pair] for pair, reason in unchecked.items() if reason is Reason.NEVER} == {0}
    assert {counts[pair] for pair, reason in unchecked.items() if reason is Reason.ADJACENT} <= {0, samples}


def test_pairs_that_touch_are_checked() -> None:
    """Base and second wrist touch in a few of a hundred thousand postures: this one is the search's."""
    unchecked = unchecked_pairs(planned_arm().urdf)
    assert ("base_link", "wrist_2_link") not in unchecked
    assert ("upper_arm_link", "wrist_1_link") not in unchecked


def test_every_joint_has_its_links_among_the_unchecked_pairs() -> None:
    unchecked = unchecked_pairs(planned_arm().urdf)
    links = [UR10.root, *(joint.child for joint in UR10.joints)]
    for pair in pairwise(links):
        assert unchecked[pair] is Reason.ADJACENT, pair


@pytest.mark.parametrize("rail", [-2.1, 0.0, 2.1])
def test_home_posture_is_free_of_collisions_among_the_cells_solids(rail: float) -> None:
    planned = Planned(margin=CLEARANCE)
    posture = planned.home()
    posture[planned.model.joint("linear_arm_actuator_joint").qposadr[0]] = rail
    unchecked = unchecked_pairs(planned_arm().urdf)
    assert {pair for pair in planned.touching(posture) if pair not in unchecked} == set()


def test_arm_that_reaches_into_a_bin_meets_the_cells_solids() -> None:
    planned = Planned(margin=0.0)
    posture = planned.home()
    posture[planned.model.joint("shoulder_lift_joint").qposadr[0]] = 0.8
    assert {pair for pair in planned.touching(posture) if pair[0] == "world"}


def test_home_is_where_a_run_begins() -> None:
    world = build_world(Trial("", has_arm=True))
    home = planned_arm().home
    assert home == INITIAL_POSITIONS
    for name, position in home.items():
        assert world.initial_qpos[world.model.joint(name).qposadr[0]] == position


def test_solids_of_planner_are_values_of_json() -> None:
    shapes = solids(build_world(Trial("", has_arm=True)))
    assert json.loads(json.dumps(shapes)) == shapes
