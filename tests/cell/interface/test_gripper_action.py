"""Actions of a parallel gripper, as seen by an actionlib client."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.interface.rows import GRIP, PARALLEL_GRIP
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.middleware.messages.control_msgs import (
    GripperCommand,
    GripperCommandActionGoal,
    GripperCommandGoal,
    ParallelGripperCommandActionGoal,
    ParallelGripperCommandGoal,
)
from cellwright.middleware.messages.conversions import joint_state, stamp
from cellwright.middleware.messages.osrf_gear import VacuumGripperControlRequest
from cellwright.middleware.messages.standard import GoalID
from cellwright.util.errors import RejectedCommandError
from tests.cell.arm_cells import finger_cell, ur5_cell
from tests.support.cells import Ear, run

ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED = range(1, 6)
FINGERS = ("left_finger_joint", "right_finger_joint")
GRIPPING = Path(__file__).parents[2] / "data" / "fingers.yaml"
"""Cell whose fingers are around a part."""
MM = 1e-3


class Client:
    """Client of both actions of the only gripper."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        ears = {
            action: [Ear(cell, f"{action}/{kind}") for kind in ("result", "feedback", "status")] for action in ACTIONS
        }
        self.ears: dict[str, list[Ear]] = ears

    def send(self, width: float, effort: float = 0.0, name: str = "goal") -> None:
        """Send a goal to the first action."""
        goal = GripperCommandGoal(GripperCommand(width, effort))
        self._publish(f"{GRIP}/goal", GripperCommandActionGoal(goal_id=GoalID(stamp(), name), goal=goal))

    def send_joints(self, name: str = "goal", **state: Any) -> None:
        """Send a goal to the second action."""
        goal = ParallelGripperCommandGoal(joint_state(**state))
        self._publish(
            f"{PARALLEL_GRIP}/goal", ParallelGripperCommandActionGoal(goal_id=GoalID(stamp(), name), goal=goal)
        )

    def cancel(self, action: str, name: str = "") -> None:
        """Cancel a goal, or all."""
        self._publish(f"{action}/cancel", GoalID(stamp(), name))

    def results(self, action: str = GRIP) -> list[tuple[str, int]]:
        """Return goal and status of each result."""
        return [(each.status.goal_id.id, each.status.status) for each in self.ears[action][0].messages]

    def result(self, action: str = GRIP) -> Any:
        """Return the content of the only result."""
        (message,) = self.ears[action][0].messages
        return message.result

    def _publish(self, topic: str, message: Any) -> None:
        self.cell.bus.publish(topic, message, node="/team")


ACTIONS = (GRIP, PARALLEL_GRIP)


@pytest.fixture
def client() -> Client:
    return Client(Cell(finger_cell()))


def gripper_of(cell: Cell) -> FingerGripper:
    assert isinstance(cell.gripper, FingerGripper)
    return cell.gripper


def test_goal_gives_feedback_and_its_result(client: Client) -> None:
    client.send(0.06)
    assert client.ears[GRIP][2].messages[-1].status_list[0].status == ACTIVE
    run(client.cell, 1.0)
    assert client.results() == [("goal", SUCCEEDED)]
    result = client.result()
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.position == pytest.approx(0.06, abs=0.5 * MM)
    feedback = [each.feedback.position for each in client.ears[GRIP][1].messages]
    assert feedback == sorted(feedback, reverse=True)
    assert 0.06 < feedback[1] < 0.1
    assert len(feedback) == 4  # in 0.4 s


def test_goal_by_joints_has_their_state(client: Client) -> None:
    client.send_joints(names=FINGERS[:1], positions=[0.03], velocities=[0.02], efforts=[8.0])
    run(client.cell, 0.5)
    middle = client.ears[PARALLEL_GRIP][1].messages[-1].feedback.state
    assert tuple(middle.name) == FINGERS
    assert middle.position.tolist() == pytest.approx([0.04, 0.04], abs=MM)
    assert middle.velocity.tolist() == pytest.approx([-0.02, -0.02], rel=0.1)
    assert gripper_of(client.cell).max_force == 16.0
    run(client.cell, 1.0)
    result = client.result(PARALLEL_GRIP)
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.state.position.tolist() == pytest.approx([0.03, 0.03], abs=0.5 * MM)


@pytest.mark.parametrize("action", ACTIONS)
def test_goal_that_grips_a_part_succeeds_stalled(action: str) -> None:
    client = Client(Cell(load_trial([GRIPPING]).trial))
    if action == GRIP:
        client.send(0.0, 12.0)
    else:
        client.send_joints(positions=[0.0], efforts=[6.0])
    run(client.cell, 1.0)
    assert client.results(action) == [("goal", SUCCEEDED)]
    assert (client.result(action).stalled, client.result(action).reached_goal) == (True, False)
    assert gripper_of(client.cell).part == "bin1|cube_1"
    if action == GRIP:
        assert client.result().effort == pytest.approx(12.0, rel=0.05)
        assert client.result().position == pytest.approx(0.04, abs=MM)


def test_actions_and_commands_end_each_others_goals(client: Client) -> None:
    client.send(0.0, name="same")
    run(client.cell, 0.1)
    client.send_joints(name="same", positions=[0.0])
    assert client.results() == [("same", PREEMPTED)]
    assert client.results(PARALLEL_GRIP) == []
    client.cell.bus.publish("/ariac/gripper/command", GripperCommand(0.02), node="/team")
    assert client.results(PARALLEL_GRIP) == [("same", PREEMPTED)]
    client.send(0.01, name="third")
    client.cell.bus.call("/ariac/gripper/control", VacuumGripperControlRequest(enable=False))
    assert client.results() == [("same", PREEMPTED), ("third", PREEMPTED)]
    assert "another command came" in client.ears[GRIP][0].messages[-1].status.text
    run(client.cell, 2.0)
    assert gripper_of(client.cell).width == pytest.approx(0.1, abs=0.5 * MM)


def test_cancel_of_one_action_leaves_the_goal_of_another(client: Client) -> None:
    client.send(0.0)
    run(client.cell, 0.2)
    client.cancel(PARALLEL_GRIP)
    assert client.results() == []
    client.cancel(GRIP)
    assert client.results() == [("goal", PREEMPTED)]
    run(client.cell, 0.5)
    assert gripper_of(client.cell).width == pytest.approx(0.08, abs=2 * MM)


@pytest.mark.parametrize("bad", [(0.2, 0.0), (-0.01, 0.0), (float("nan"), 0.0), (0.0, -1.0), (0.0, float("inf"))])
def test_bad_goal_is_rejected_with_a_reason_and_changes_nothing(client: Client, bad: tuple[float, float]) -> None:
    client.send(0.02, name="before")
    with pytest.raises(RejectedCommandError, match="got"):
        client.send(*bad, name="bad")
    with pytest.raises(RejectedCommandError, match="got"):
        client.send_joints(positions=[bad[0] / 2], efforts=[bad[1] / 2])
    with pytest.raises(RejectedCommandError, match="got"):
        client.cell.bus.publish("/ariac/gripper/command", GripperCommand(*bad), node="/team")
    assert client.results() == [("bad", REJECTED)]
    assert client.results(PARALLEL_GRIP) == [("goal", REJECTED)]
    assert (client.result().reached_goal, client.result().stalled) == (False, False)
    assert sum(client.cell.bus.refusals.counts.values()) == 3
    run(client.cell, 1.5)
    assert client.results()[1:] == [("before", SUCCEEDED)]


def test_goal_goes_on_from_a_snapshot(client: Client) -> None:
    cell = client.cell
    client.send(0.05)
    run(cell, 0.2)
    snapshot = take_snapshot(cell.simulation)
    run(cell, 1.0)
    expected = cell.state_hash()
    restore_snapshot(cell.simulation, snapshot)
    assert gripper_of(cell).goals.active is not None
    run(cell, 1.0)
    assert cell.state_hash() == expected
    assert client.results() == [("goal", SUCCEEDED)] * 2
    cell.reset()
    assert gripper_of(cell).goals.goal is None


def test_cup_has_no_such_actions() -> None:
    cell = Cell(ur5_cell())
    assert not [name for name in (*cell.bus.actions, *cell.topics()) if "gripper_cmd" in name]
    assert not cell.bus.actions.keys() & {*ACTIONS}
