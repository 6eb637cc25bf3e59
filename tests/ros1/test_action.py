"""The arm's action over the real actionlib protocol: results, feedback, cancel, preemption, refusals."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground, ground

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

NAMES = [
    "linear_arm_actuator_joint",
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
]
READY = [0.0, 3.2, -1.2, 2.5, 3.5, -1.51, 0.0]
ASIDE = [0.5, 3.2, -1.2, 2.5, 3.5, -1.51, 0.0]

SUCCEEDED, PREEMPTED, REJECTED, ABORTED = 3, 2, 5, 4
INVALID_GOAL, INVALID_JOINTS, PATH_TOLERANCE_VIOLATED = -1, -2, -4


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    with ground(tmp_path_factory.mktemp("action"), ros1_messages) as made:
        made.serve("lesson", "-d", "--speed", "2")
        yield made


def act(goals: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Send goals one after the other to the action server; what became of each.

    A goal: `points` as pairs of time [s] and positions, in the order of `names`; `cancel` after so many seconds;
    `leave` it so long after it was sent, and send the next; path tolerance for the first joint.
    """
    import actionlib
    import rospy
    from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, JointTolerance
    from trajectory_msgs.msg import JointTrajectoryPoint

    rospy.init_node("actor", anonymous=True)
    while not rospy.get_time():  # else the first /clock, some time into the run, would end a wait that began at 0
        rospy.rostime.wallsleep(0.01)
    name = "/ariac/arm/follow_joint_trajectory"
    clients, results = [], []
    for wanted in goals:
        client = actionlib.SimpleActionClient(name, FollowJointTrajectoryAction)
        assert client.wait_for_server(rospy.Duration(20.0))
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = wanted["names"]
        for seconds, positions in wanted["points"]:
            goal.trajectory.points.append(
                JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(seconds))
            )
        if "tolerance" in wanted:
            goal.path_tolerance.append(JointTolerance(name=wanted["names"][0], position=wanted["tolerance"]))
        feedback: list[Any] = []
        client.send_goal(goal, feedback_cb=feedback.append)
        clients.append((client, feedback, rospy.get_time()))
        if "cancel" in wanted:
            rospy.sleep(wanted["cancel"])
            client.cancel_goal()
        if "leave" in wanted:
            rospy.sleep(wanted["leave"])
        else:
            assert client.wait_for_result(rospy.Duration(20.0)), "no result"
    for client, feedback, begun in clients:
        assert client.wait_for_result(rospy.Duration(5.0)), "no result"
        stamps = [each.header.stamp.to_sec() for each in feedback]
        result = client.get_result()
        results.append(
            {
                "state": client.get_state(),
                "code": result and result.error_code,
                "text": client.get_goal_status_text(),
                "stamps": stamps,
                "desired": feedback and list(feedback[-1].desired.positions),
                "begun": begun,
            }
        )
    return results


def goal(*points: tuple[float, list[float]], names: list[str] = NAMES, **more: float) -> dict[str, Any]:
    return {"names": names, "points": points, **more}


def test_a_goal_is_reached_with_feedback_ten_times_a_second(cell: Ground) -> None:
    (result,) = cell.client(act, [goal((1.0, READY), (3.0, ASIDE))]).value()
    assert (result["state"], result["code"]) == (SUCCEEDED, 0)
    stamps = result["stamps"]
    assert len(stamps) >= 28
    assert (len(stamps) - 1) / (stamps[-1] - stamps[0]) == pytest.approx(10.0, rel=0.05)
    assert result["desired"] == pytest.approx(ASIDE, abs=0.1)


def test_the_joints_in_another_order(cell: Ground) -> None:
    order = sorted(range(7), key=lambda index: NAMES[index])
    shuffled = goal((1.0, [ASIDE[index] for index in order]), names=[NAMES[index] for index in order])
    (result,) = cell.client(act, [shuffled]).value()
    assert (result["state"], result["code"]) == (SUCCEEDED, 0)


def test_a_goal_called_off(cell: Ground) -> None:
    (result,) = cell.client(act, [goal((8.0, ASIDE), cancel=0.5)]).value()
    assert result["state"] == PREEMPTED


def test_a_goal_that_another_takes_the_place_of(cell: Ground) -> None:
    first, second = cell.client(act, [goal((9.0, READY), leave=1.0), goal((1.0, READY))]).value()
    assert first["state"] == PREEMPTED
    assert (second["state"], second["code"]) == (SUCCEEDED, 0)


@pytest.mark.parametrize(
    ("wanted", "code"),
    [
        (goal((1.0, READY[:6]), names=NAMES[:6]), INVALID_JOINTS),
        (goal((1.0, READY), names=[*NAMES[:6], "seventh_joint"]), INVALID_JOINTS),
    ],
    ids=["six joints", "an unknown joint"],
)
def test_a_goal_that_is_refused(cell: Ground, wanted: dict[str, Any], code: int) -> None:
    (result,) = cell.client(act, [wanted]).value()
    assert (result["state"], result["code"]) == (REJECTED, code)


def test_a_goal_whose_path_is_left(cell: Ground) -> None:
    """Five metres in a tenth of a second are too much for the rail, and the tolerance says so at once."""
    hurried = goal((0.1, [2.0, *READY[1:]]), tolerance=0.01)
    (result,) = cell.client(act, [hurried]).value()
    assert (result["state"], result["code"]) == (ABORTED, PATH_TOLERANCE_VIOLATED)
