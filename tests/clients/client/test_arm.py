"""Arm of a cell as a client has it."""

import pytest

from cellwright import Cell, Client
from cellwright.clients.client.arm import ARM_JOINTS, trajectory_message
from cellwright.config.trial.gear2017 import load_trial
from tests.cell.arm_cells import TWO_ON_A_RAIL


def test_command_and_suction_are_those_of_one_of_two_arms() -> None:
    cell = Cell(load_trial(text=TWO_ON_A_RAIL).trial)
    client = Client.in_process(cell)
    first, second = client.arm("arm1"), client.arm("arm2")
    assert client.arm("arm1") is first
    client.sleep(0.1)
    before = dict(second.joint_positions)
    goal = [first.joint_positions[name] + 0.1 for name in ARM_JOINTS]
    assert first.move_arm([goal], [1.0])
    assert [first.joint_positions[name] for name in ARM_JOINTS] == pytest.approx(goal, abs=0.01)
    assert second.joint_positions == pytest.approx(before, abs=2e-3)
    assert first.control_gripper(enable=True)
    client.sleep(0.1)
    assert (first.gripper_enabled, second.gripper_enabled, first.gripper_attached) == (True, False, False)


def test_sleeping_client_has_new_states_of_all_arms_afterwards() -> None:
    client = Client.in_process(Cell(load_trial(text=TWO_ON_A_RAIL).trial))
    arms = [client.arm(name) for name in ("arm1", "arm2")]
    client.sleep(0.1)
    counts = [arm.gripper.count for arm in arms]
    client.idle(1.0)
    assert all(0 < arm.gripper.count - count < 100 for arm, count in zip(arms, counts, strict=True))


def test_trajectory_begins_on_arrival_with_the_joints_as_named() -> None:
    message = trajectory_message(["a", "b"], [(1.0, 2.0)], [0.5])
    assert message.joint_names == ["a", "b"]
    assert message.header.stamp.sec == 0
    assert message.points[0].positions.tolist() == [1.0, 2.0]
