"""A cell as MoveIt plans in it, against the cell's model: collisions, home posture, limits and names."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright import load_trial
from cellwright.cell.controllers import TRAJECTORIES
from cellwright.cell.export.description import CellDescription, cell_description
from cellwright.cell.export.moveit import SPEED_SHARE, moveit_package, planned_cell, read_package
from cellwright.cell.model.build import build_world
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import INITIAL_POSITIONS, UR10
from cellwright.mechanism.link_collisions import CLEARANCE, Reason, geoms_of, touched_model
from cellwright.middleware.ros2.packages.contents import MOVEIT
from cellwright.middleware.ros2.packages.moveit import SIMPLE_MANAGER, PlannedCell, controllers, joint_limits, srdf
from cellwright.util.errors import DescriptionError
from tests.cell.arm_cells import PEDESTAL, TWO_UR5, carried_cell, ur5_cell
from tests.cell.robot_cells import arm_on_robot
from tests.middleware.ros2.packages.test_moveit import chain, check_srdf

PAIR = TWO_UR5.replace("tip: tool0", "tip: tool0\n      names: prefixed")
CELLS = ["lesson", "ur5", "pair"]


@cache
def planned(name: str) -> tuple[Trial, CellDescription, PlannedCell]:
    own = {"ur5": PEDESTAL, "pair": PAIR}
    trial = ur5_cell(own[name]) if name in own else load_trial(name)
    described = cell_description(trial, build_world(trial), MOVEIT)
    return trial, described, planned_cell(trial, described)


class Sampled:
    """A cell as a planner has it: the collision shapes of its description, read back, in any posture."""

    def __init__(self, described: CellDescription, folder: Path) -> None:
        self.model = touched_model(read_package(folder, described))
        self.data: Any = mujoco.MjData(self.model)

    def postures(self, count: int, seed: int) -> Iterator[None]:
        """Put the cell into random postures, one after the other."""
        random = np.random.default_rng(seed)
        for _ in range(count):
            self.data.qpos[:] = random.uniform(*self.model.jnt_range.T)
            mujoco.mj_kinematics(self.model, self.data)
            yield

    def at(self, posture: dict[str, float]) -> None:
        """Put the cell into a posture."""
        for name, position in posture.items():
            self.data.joint(name).qpos[0] = position
        mujoco.mj_kinematics(self.model, self.data)

    def distance(self, one: str, other: str) -> float:
        """Return the distance of two links [m], at most 1; negative if they overlap."""
        pairs = product(geoms_of(self.model, one), geoms_of(self.model, other))
        return float(min(mujoco.mj_geomDistance(self.model, self.data, a, b, 1.0, None) for a, b in pairs))


@pytest.mark.slow
@pytest.mark.parametrize("name", CELLS)
def test_pairs_that_are_never_near_are_apart_in_another_sample(name: str, tmp_path: Path) -> None:
    _, described, cell = planned(name)
    sampled = Sampled(described, tmp_path)
    never = [pair for pair, reason in cell.unchecked.items() if reason == Reason.NEVER]
    nearest = dict.fromkeys(never, np.inf)
    for _ in sampled.postures(1500, seed=99):
        for pair in never:
            nearest[pair] = min(nearest[pair], sampled.distance(*pair))
    assert len(never) > 10
    assert min(nearest.values()) > CLEARANCE, min(nearest.items(), key=lambda item: item[1])


@pytest.mark.slow
@pytest.mark.parametrize("name", CELLS)
def test_arm_at_home_meets_nothing_that_is_checked(name: str, tmp_path: Path) -> None:
    _, described, cell = planned(name)
    sampled = Sampled(described, tmp_path)
    for arm in cell.arms:
        sampled.at(dict(arm.home))
    links = [link for link in ET.fromstring(cell.urdf).iter("link") if link.find("collision") is not None]
    names = [link.attrib["name"] for link in links]
    pairs = [(one, other) for n, one in enumerate(names) for other in names[n + 1 :]]
    assert [pair for pair in pairs if pair not in cell.unchecked and sampled.distance(*pair) <= 0.0] == []


def test_contact_that_a_sample_misses_is_checked() -> None:
    """Base and second wrist touch in a few of a hundred thousand postures: this one is the descent's."""
    _, _, cell = planned("lesson")
    assert ("base_link", "wrist_2_link") not in cell.unchecked
    assert ("upper_arm_link", "wrist_1_link") not in cell.unchecked
    assert ("forearm_link", "bin5") not in cell.unchecked


def test_links_of_a_joint_and_what_stands_still_are_adjacent() -> None:
    _, described, cell = planned("lesson")
    for pair in [*pairwise([UR10.root, *(joint.child for joint in UR10.joints)]), *pairwise(described.bodies)]:
        assert cell.unchecked[pair] == Reason.ADJACENT, pair


@pytest.mark.parametrize("name", CELLS)
def test_names_of_srdf_are_those_of_the_description(name: str) -> None:
    _, _, cell = planned(name)
    semantic = check_srdf(srdf(cell), cell.urdf)
    chains = {group.attrib["name"]: group.find("chain") for group in semantic.findall("group")}
    joints = {
        name: tuple(chain(cell.urdf, each.attrib["base_link"], each.attrib["tip_link"]))
        for name, each in chains.items()
        if each is not None
    }
    assert joints == cell.groups
    together = {"both"} if len(cell.arms) == 2 else set()
    assert chains.keys() - joints.keys() == {cell.tool_group(arm) for arm in cell.arms} | together
    assert [joints[cell.whole_group(arm)] for arm in cell.arms] == [arm.joints for arm in cell.arms]


def test_arm_of_2017_is_a_case_of_any_arm() -> None:
    _, _, cell = planned("lesson")
    (arm,) = cell.arms
    assert cell.groups == {"arm_on_rail": ARM_JOINTS, "arm": ARM_JOINTS[1:]}
    assert arm.home == INITIAL_POSITIONS
    assert arm.action == f"/{TRAJECTORIES}/follow_joint_trajectory"
    assert cell.passive_joints == ["vacuum_gripper_joint"]


def test_each_of_two_arms_has_its_own_names_and_meets_the_other() -> None:
    trial, _, cell = planned("pair")
    assert [arm.action for arm in cell.arms] == [
        f"/{name}_controller/follow_joint_trajectory" for name in ("arm1", "arm2")
    ]
    assert cell.groups["arm2"] == tuple(f"arm2_{name}" for name in joints_of(trial.arms[1], trial.arm_models))
    assert ("arm1_wrist_3_link", "arm2_wrist_3_link") not in cell.unchecked
    assert cell.unchecked["arm1_base_link", "arm2_base_link"] == Reason.ADJACENT
    assert len(cell.unchecked) < len(trial.arms) * 60


def test_arm_on_another_hangs_on_its_link_and_is_its_load() -> None:
    trial = carried_cell()
    gantry, small = trial.arms
    weak = replace(gantry, mount=replace(gantry.mount, effort=60.0))
    trial = replace(trial, layout=replace(trial.layout, arms=(weak, small)))
    described = cell_description(trial, build_world(trial), MOVEIT)
    assert '<parent link="gantry_carriage" />\n    <child link="small_mount" />' in described.urdf
    cell = planned_cell(trial, described)
    assert cell.unchecked["gantry_base_link", "small_base_link"] == Reason.ADJACENT
    assert ("gantry_forearm_link", "small_forearm_link") not in cell.unchecked
    alone = replace(trial, layout=replace(trial.layout, arms=trial.arms[:1]))
    (unladen,) = planned_cell(alone, cell_description(alone, build_world(alone), MOVEIT)).arms
    rail = "gantry_rail_joint"
    # half of 60 N moves 31.0 kg alone, and another 21.0 kg with the arm on it
    assert unladen.max_acceleration[rail] == pytest.approx(30.0 / 31.0, rel=0.01)
    assert cell.arms[0].max_acceleration[rail] == pytest.approx(30.0 / 52.0, rel=0.01)


def test_arms_whose_joints_have_other_names_in_messages_are_refused() -> None:
    message = "MoveIt needs the names of the robot description in messages (got plain); write names: prefixed"
    with pytest.raises(DescriptionError) as caught:
        moveit_package(ur5_cell(TWO_UR5))
    assert [*map(str, caught.value.problems)] == [f"cell.arms.arm1.names: {message}"]


def test_arm_on_a_robot_is_refused() -> None:
    with pytest.raises(DescriptionError) as caught:
        moveit_package(arm_on_robot())
    (problem,) = map(str, caught.value.problems)
    assert problem.startswith(
        "cell.arms.arm.mount: MoveIt plans for arms that stand in the world or on each other (got"
    )


def test_arm_without_tool_has_no_end_effector() -> None:
    text = (
        "cell: {{arms: {{arm: {{model: {model}, mount: {{kind: floor, at: [0, 0]}}, tip: tool0, tool: {{kind: none}},"
    )
    trial = ur5_cell(text + " home: {{shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_2_joint: -1.57}}}}}}}}")
    files = moveit_package(trial)
    semantic = ET.fromstring(files["config/cellwright.srdf"])
    assert semantic.find("end_effector") is None
    assert [group.attrib["name"] for group in semantic.findall("group")] == ["arm"]


def test_fingers_open_and_close_by_the_action_of_the_gripper() -> None:
    trial = ur5_cell(PEDESTAL.replace("tip: tool0", "tip: tool0\n      tool: {{kind: parallel}}"))
    cell = planned_cell(trial, cell_description(trial, build_world(trial), MOVEIT))
    semantic = check_srdf(srdf(cell), cell.urdf)
    group = next(each for each in semantic.findall("group") if each.get("name") == "tool")
    assert [link.attrib["name"] for link in group] == ["gripper_palm", "left_finger", "right_finger"]
    assert cell.passive_joints == []
    joints = ["left_finger_joint", "right_finger_joint"]
    states = {
        each.attrib["name"]: [(joint.get("name"), joint.get("value")) for joint in each]
        for each in semantic.findall("group_state")
        if each.get("group") == "tool"
    }
    assert states == {"open": [(joint, "0.05") for joint in joints], "closed": [(joint, "0.0") for joint in joints]}
    found = controllers(cell)
    assert found["moveit_controller_manager"] == SIMPLE_MANAGER
    simple = found["moveit_simple_controller_manager"]
    assert simple["controller_names"] == ["arm_controller", "gripper_controller"]
    assert simple["gripper_controller"] == {
        "type": "GripperCommand",
        "action_ns": "gripper_cmd",
        "default": True,
        "parallel": True,
        "joints": joints,
    }
    limits = joint_limits(cell)["joint_limits"]
    assert [limits[joint]["max_velocity"] for joint in joints] == [0.05, 0.05]  # half of the gripper's 0.1 m/s
    (effector,) = semantic.findall("end_effector")
    assert effector.attrib["parent_link"] == "tool0"


def test_drives_follow_at_the_limits_of_the_package() -> None:
    """All joints swing at once, each at its maximum acceleration and up to its maximum velocity, through the bin."""
    trial, _, cell = planned("ur5")
    (arm,) = cell.arms
    assert {name: limits.velocity * SPEED_SHARE for name, limits in trial.joints.items()} == arm.max_velocity
    assert all(acceleration > 1.0 for acceleration in arm.max_acceleration.values())
    world = build_world(trial)
    model, data = world.model, world.initial_data()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    joints = [data.joint(f"arm/{name}") for name in arm.joints]
    inputs = np.array([model.actuator_ctrladr[model.actuator(f"arm/{name}").id] for name in arm.joints])
    speeds, rises = (np.array([each[name] for name in arm.joints]) for each in (arm.max_velocity, arm.max_acceleration))
    rises = speeds / rises
    goal, worst = np.array([joint.qpos[0] for joint in joints]), 0.0
    for step in range(500):
        time = step * model.opt.timestep
        speed = speeds * np.clip(np.minimum(time / rises, 3.0 - time / rises), 0.0, 1.0)
        goal += speed * model.opt.timestep
        data.ctrl[inputs], data.ctrl[inputs + 1] = goal, speed
        worst = max(worst, *(abs(joint.qpos[0] - place) for joint, place in zip(joints, goal, strict=True)))
        mujoco.mj_step(model, data)
    assert np.abs(speed).max() == 0.0
    assert worst < 0.01


def test_package_has_its_own_name_everywhere() -> None:
    files = moveit_package(ur5_cell(), "small_cell")
    assert b"small_cell" in files["package.xml"]
    assert not [path for path, content in files.items() if MOVEIT.encode() in content]
