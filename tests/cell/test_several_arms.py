"""Cells with several arms: names, motions, contacts, grippers, and the same state twice."""

import math
from collections.abc import Iterator
from xml.etree.ElementTree import fromstring

import pytest

from cellwright import Cell, Client
from cellwright.cell.interface.parameters import parameters
from cellwright.clients.client import ClientArm
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.trial.gear2017 import load_trial
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.chain import chain_of
from cellwright.running.run.collisions import CollisionWatch
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose
from tests.cell.arm_cells import TWO_ON_A_RAIL, TWO_UR5, ur5_cell

RAIL = "linear_arm_actuator_joint"
BOARD = "bin1|board_part_1"


def slide(arm: ClientArm, rail: float, duration: float) -> None:
    """Send an arm of 2017 along the rail [m], with its other joints as they are."""
    joints = {name: value for name, value in arm.joint_positions.items() if name != "vacuum_gripper_joint"}
    arm.send_arm([list((joints | {RAIL: rail}).values())], [duration], joints=[*joints])


def moving_joints(text: object) -> set[str | None]:
    """Return the names of the joints of a robot description that are not fixed."""
    return {each.get("name") for each in fromstring(str(text)).iter("joint") if each.get("type") != "fixed"}


def meet() -> tuple[list[str], str]:
    """Drive two arms on one rail into each other; return the links and obstacles, and the state's hash."""
    cell = Cell(load_trial(text=TWO_ON_A_RAIL).trial)
    client = Client.in_process(cell)
    watch = CollisionWatch(cell)
    arms = [client.arm(name) for name in cell.arms]
    client.sleep(0.1)
    slide(arms[0], 0.3, 2.0)
    slide(arms[1], -0.3, 2.0)
    client.sleep(3.0)
    return [f"{each.link} {each.obstacle}" for each in watch.end()], cell.state_hash()


def test_arms_that_meet_on_a_rail_touch_by_name_and_twice_alike() -> None:
    first, second = meet(), meet()
    assert first == second
    assert first[0]
    assert all(each.startswith(("arm1_", "arm2_")) and each.split()[1][:5] in ("arm1_", "arm2_") for each in first[0])


def test_arms_on_one_rail_pass_its_beam() -> None:
    cell = Cell(load_trial(text=TWO_ON_A_RAIL).trial)
    client = Client.in_process(cell)
    arm, other = client.arm("arm1"), client.arm("arm2")
    client.sleep(0.1)
    slide(arm, -0.9, 1.0)
    client.sleep(2.0)
    assert arm.joint_positions[RAIL] == pytest.approx(-0.9, abs=0.005)
    assert other.joint_positions[RAIL] == pytest.approx(1.2, abs=0.005)


def test_each_arm_has_its_topics_services_and_parameters() -> None:
    trial = load_trial(text=TWO_ON_A_RAIL).trial
    cell = Cell(trial)
    topics = cell.topics()
    for arm in ("arm1", "arm2"):
        assert {f"/ariac/{arm}/{each}" for each in ("joint_states", "arm/state", "gripper/state")} <= {*topics}
    assert "/ariac/arm/state" not in topics
    assert cell.bus.actions == {
        f"/ariac/{arm}/arm/follow_joint_trajectory": "control_msgs/FollowJointTrajectory" for arm in ("arm1", "arm2")
    }
    found = parameters(trial, competition=True)["ariac"]
    assert isinstance(found, dict)
    assert "arm" not in found
    for name in ("arm1", "arm2"):
        own = found[name]
        assert isinstance(own, dict)
        assert set(own) == {"robot_description", "arm", "joint_state_controller"}


def test_names_of_joints_are_those_of_each_arm_and_of_the_description() -> None:
    trial = ur5_cell(TWO_UR5)
    client = Client.in_process(Cell(trial))
    plain = sorted(joints_of(trial.arms[0], trial.arm_models))
    first, second = client.arm("arm1"), client.arm("arm2")
    client.sleep(0.1)
    assert [*first.joint_positions] == [*plain, "vacuum_gripper_joint"]
    assert [*second.joint_positions] == [*(f"arm2_{name}" for name in plain), "vacuum_gripper_joint"]
    everything = {f"{arm}_{name}" for arm in ("arm1", "arm2") for name in plain}
    assert {*client.joint_positions} == everything
    found = parameters(trial, competition=True)["ariac"]
    assert isinstance(found, dict)
    assert moving_joints(found["robot_description"]) == everything
    own = found["arm1"]
    assert isinstance(own, dict)
    assert moving_joints(own["robot_description"]) == {*plain}


def test_frames_of_all_arms_have_their_prefix() -> None:
    client = Client.in_process(Cell(ur5_cell(TWO_UR5)))
    frames = client.latest("/tf")
    client.sleep(0.1)
    children = {each.child_frame_id for each in frames.message.transforms}
    assert {"arm1_forearm_link", "arm2_forearm_link"} <= children
    assert not [name for name in children if "/" in name]


def test_joints_at_start_are_named_by_their_arm() -> None:
    cell = Cell(ur5_cell(TWO_UR5))
    cell.reset(joints={"arm2/elbow_joint": 1.0})
    assert cell.arms["arm2"].read().positions[2] == pytest.approx(1.0)
    assert cell.arms["arm1"].read().positions[2] == pytest.approx(1.6)
    with pytest.raises(UnknownNameError, match=r"arm1/elbow_joint"):
        cell.reset(joints={"elbow_joint": 1.0})


def test_only_arm_is_refused_where_there_are_several() -> None:
    cell = Cell(ur5_cell(TWO_UR5))
    with pytest.raises(UsageError, match=r"several arms; take one of arm1, arm2 from cell\.arms"):
        _ = cell.arm
    with pytest.raises(UnknownNameError, match=r"unknown arm 'arm3'; did you mean"):
        Client.in_process(cell).arm("arm3")


class Pair:
    """Program of two UR5 that moves their tools."""

    def __init__(self, cell: Cell) -> None:
        self.cell, self.client = cell, Client.in_process(cell)
        self.solvers = {}
        for arm in cell.trial.arms:
            model = cell.trial.arm_models[arm.name]
            chain = chain_of(model.robot, arm.tip, tip_T_tool=Pose((0.0, 0.0, arm.tool.length)))
            home = [arm.home.get(joint.name, 0.0) for joint in chain.joints]
            self.solvers[arm.name] = solver_of(chain, home), (arm.pose @ model.mount_T_root).inverse(), arm.joint_prefix
            self.client.arm(arm.name)
        self.client.sleep(0.1)

    def go(self, name: str, x: float, y: float, z: float, turn: float = math.pi) -> None:
        """Move the face of a cup to a point [m] within two seconds; it looks down, or up at a turn of 0."""
        solver, base_T_world, prefix = self.solvers[name]
        arm = self.client.arm(name)
        near = [arm.joint_positions[prefix + joint] for joint in solver.joints]
        posture = next(iter(solver.branches(base_T_world @ Pose.from_rpy((x, y, z), (turn, 0.0, 0.0)), near)))
        arm.move_arm([posture], [2.0], joints=[prefix + joint for joint in solver.joints])
        self.client.sleep(0.3)  # for the gripper's second check


def hand_over() -> Iterator[tuple[str | None, str | None]]:
    """Take a part from the bin with one arm, grip it with the other too, and let go; yield what both hold."""
    cell = Cell(ur5_cell(TWO_UR5))
    pair = Pair(cell)
    first, second = (pair.client.arm(name) for name in cell.arms)
    x, y, z = cell.parts.pose(cell.parts.part(BOARD)).position
    top = z + 0.02
    pair.go("arm1", x - 0.09, y, top + 0.1)
    first.control_gripper(True)
    pair.go("arm1", x - 0.09, y, top - 0.002)
    yield cell.grippers["arm1"].part, cell.grippers["arm2"].part
    pair.go("arm2", x + 0.09, y, top + 0.1)
    second.control_gripper(True)
    pair.go("arm2", x + 0.09, y, top - 0.002)
    yield cell.grippers["arm1"].part, cell.grippers["arm2"].part
    first.control_gripper(False)
    pair.client.sleep(0.2)
    yield cell.grippers["arm1"].part, cell.grippers["arm2"].part
    second.control_gripper(False)
    yield cell.grippers["arm1"].part, cell.grippers["arm2"].part


def test_part_is_handed_from_one_gripper_to_another() -> None:
    assert [*hand_over()] == [(BOARD, None), (BOARD, BOARD), (None, BOARD), (None, None)]
