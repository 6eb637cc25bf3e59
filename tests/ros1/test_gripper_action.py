"""Action of a parallel gripper over the real actionlib protocol: it grips and opens, is cancelled and refused."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

CELL = Path(__file__).parents[1] / "data" / "fingers.yaml"
PREEMPTED, SUCCEEDED, REJECTED = 2, 3, 5


def program() -> dict[str, Any]:
    import actionlib
    import rospy
    import rostopic
    from control_msgs.msg import GripperCommandAction, GripperCommandGoal
    from osrf_gear.msg import VacuumGripperState

    rospy.init_node("gripper")
    wait_until(rospy.get_time, "simulation time")
    name = "/ariac/gripper/gripper_cmd"
    client = actionlib.SimpleActionClient(name, GripperCommandAction)
    assert client.wait_for_server()
    feedback: list[Any] = []
    states: list[Any] = []
    rospy.Subscriber("/ariac/gripper/state", VacuumGripperState, states.append)

    def goal(width: float, effort: float = 0.0) -> Any:
        made = GripperCommandGoal()
        made.command.position, made.command.max_effort = width, effort
        return made

    def outcome() -> list[Any]:
        assert client.wait_for_result(), "no result"
        result = client.get_result()
        return [client.get_state(), result.position, result.effort, result.stalled, result.reached_goal]

    client.send_goal(goal(0.0, 12.0), feedback_cb=feedback.append)
    gripped = outcome()
    wait_until(lambda: states[-1].attached, "a part")
    client.send_goal(goal(0.1), feedback_cb=feedback.append)
    opened = outcome()
    wait_until(lambda: not states[-1].attached, "no part")
    client.send_goal(goal(0.045))
    rospy.sleep(0.1)
    client.cancel_goal()
    cancelled = outcome()
    other = actionlib.SimpleActionClient(name, GripperCommandAction)
    assert other.wait_for_server()
    client.send_goal(goal(0.045))
    rospy.sleep(0.1)
    other.send_goal(goal(0.09))
    replaced = outcome()
    refused = []
    for bad in (goal(0.2), goal(float("nan")), goal(0.05, -1.0)):
        client.send_goal(bad)
        refused.append([*outcome(), client.get_goal_status_text()])
    return {
        "gripped": gripped,
        "opened": opened,
        "cancelled": cancelled,
        "replaced": replaced,
        "refused": refused,
        "feedback": [each.position for each in feedback],
        "parallel": [each[0] for each in rostopic.get_topic_list()[1] if "parallel" in each[0]],
    }


def test_program_grips_with_the_standard_action(master: Ground) -> None:
    cell = master.serve(str(CELL), "-d")
    found = master.client(program).value()
    state, width, effort, *flags = found["gripped"]
    assert (state, flags) == (SUCCEEDED, [True, False])
    assert width == pytest.approx(0.04, abs=0.001)
    assert effort == pytest.approx(12.0, rel=0.05)
    state, width, _, *flags = found["opened"]
    assert (state, flags) == (SUCCEEDED, [False, True])
    assert width == pytest.approx(0.1, abs=0.001)
    assert 0.039 < min(found["feedback"]) < max(found["feedback"]) < 0.101
    assert found["cancelled"][0] == PREEMPTED
    assert 0.05 < found["cancelled"][1] < 0.1
    assert found["replaced"][0] == PREEMPTED
    assert [each[0] for each in found["refused"]] == [REJECTED] * 3
    assert all("(got " in each[-1] for each in found["refused"])
    assert found["parallel"] == []
    cell.wait_for(r"max_effort must be a number from 0 \(got -1\)")
