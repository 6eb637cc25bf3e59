"""Arm of a cell as a client has it."""

from pathlib import Path

import pytest

from cellwright import Cell, Client, Trial
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.clients.client.arm import ARM_JOINTS, trajectory_message
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from tests.cell.arm_cells import FACING_UR5, PEDESTAL, TWO_ON_A_RAIL, ur5_cell

FINGERS = Path(__file__).parents[2] / "data" / "fingers.yaml"
"""Cell whose fingers are around a part."""


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


@pytest.mark.parametrize("text", [PEDESTAL, FACING_UR5.replace("DISTANCE", "1.1")])
def test_arm_of_any_model_takes_a_command_before_its_first_joint_states(text: str) -> None:
    trial = ur5_cell(text)
    client = Client.in_process(Cell(trial))
    arm = client.arm("arm2") if trial.arms[0].namespace else client
    assert arm.joint_states.message is None
    before = arm.joints
    goal = [{"elbow_joint": 1.5, "shoulder_lift_joint": -1.1}.get(name.removeprefix("arm2_"), 0.0) for name in before]
    arm.send_arm([goal], [1.0])
    client.sleep(0.02)
    assert (len(before), before) == (6, arm.joints)


def test_arm_of_a_cell_without_a_description_has_the_joints_of_2017(monkeypatch: pytest.MonkeyPatch) -> None:
    client = Client.in_process(Cell(Trial("one arm", has_arm=True)))
    assert tuple(client.joints) == ARM_JOINTS
    monkeypatch.setattr("cellwright.clients.client.description.LAYOUT", "/another/layout")
    assert client.joints == ARM_JOINTS


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


def test_gripper_is_moved_to_a_width_and_stops_at_a_part() -> None:
    cell = Cell(load_trial([FINGERS]).trial)
    client = Client.in_process(cell)
    assert client.gripper_width is None
    assert client.move_gripper(0.09)
    assert client.gripper_width == pytest.approx(0.09, abs=0.001)
    assert not client.move_gripper(0.0, effort=12.0)
    assert client.gripper_attached
    assert client.gripper_width == pytest.approx(0.04, abs=0.001)
    assert isinstance(cell.gripper, FingerGripper)
    assert cell.gripper.max_force == 12.0
    assert client.move_gripper(0.1)
    assert not client.gripper_attached


@pytest.mark.parametrize(("width", "effort"), [(0.2, 0.0), (float("nan"), 0.0), (0.05, -1.0)])
def test_gripper_refuses_a_width_or_force_out_of_range(width: float, effort: float) -> None:
    client = Client.in_process(Cell(load_trial([FINGERS]).trial))
    with pytest.raises(RejectedCommandError, match="got"):
        client.move_gripper(width, effort)


def test_gripper_that_has_no_time_to_arrive_is_not_there() -> None:
    client = Client.in_process(Cell(load_trial([FINGERS]).trial))
    client.sleep(0.1)
    assert not client.move_gripper(0.05, timeout=0.1)


def test_cup_cannot_be_moved_to_a_width() -> None:
    client = Client.in_process(Cell(load_trial(text=TWO_ON_A_RAIL).trial))
    with pytest.raises(UnknownNameError, match="/ariac/arm1/gripper/command"):
        client.arm("arm1").move_gripper(0.05)
