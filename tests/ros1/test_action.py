"""The arm's action over the real actionlib protocol: results, feedback, cancel, preemption, refusals."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import ground
from tests.support.waiting import wait_until

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

SUCCEEDED, PREEMPTED, REJECTED, ABORTED, RECALLED = 3, 2, 5, 4, 8
INVALID_GOAL, INVALID_JOINTS, PATH_TOLERANCE_VIOLATED = -1, -2, -4


def act(runs: dict[str, list[dict[str, Any]]]) -> dict[str, list[dict[str, Any]]]:
    """Send goals one after the other to the action server; return the outcome of each.

    A goal has:

    - `points`: pairs of time [s] and positions, in the order of `names`
    - `cancel`: time until it is cancelled [s]
    - `leave`: time until the next goal is sent [s]
    - `tolerance`: path tolerance of the first joint

    Args:
        runs: goals by the name of their run.
    """
    import actionlib
    import rospy
    from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, JointTolerance
    from trajectory_msgs.msg import JointTrajectoryPoint

    rospy.init_node("actor", anonymous=True)
    # else the first /clock, some time into the run, would end a wait from 0
    wait_until(rospy.get_time, "simulation time")
    name = "/ariac/arm/follow_joint_trajectory"

    def send(request: dict[str, Any]) -> tuple[Any, list[Any]]:
        client = actionlib.SimpleActionClient(name, FollowJointTrajectoryAction)
        assert client.wait_for_server()
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = request["names"]
        for seconds, positions in request["points"]:
            goal.trajectory.points.append(
                JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(seconds))
            )
        if "tolerance" in request:
            goal.path_tolerance.append(JointTolerance(name=request["names"][0], position=request["tolerance"]))
        feedback: list[Any] = []
        client.send_goal(goal, feedback_cb=feedback.append)
        if "cancel" in request:
            rospy.sleep(request["cancel"])
            client.cancel_goal()
        if "leave" in request:
            rospy.sleep(request["leave"])
        else:
            assert client.wait_for_result(), "no result"
        return client, feedback

    def outcome(client: Any, feedback: list[Any]) -> dict[str, Any]:
        assert client.wait_for_result(), "no result"
        result = client.get_result()
        return {
            "state": client.get_state(),
            "code": result and result.error_code,
            "stamps": [each.header.stamp.to_sec() for each in feedback],
            "desired": feedback and list(feedback[-1].desired.positions),
        }

    return {run: [outcome(*sent) for sent in [send(request) for request in goals]] for run, goals in runs.items()}


def goal(*points: tuple[float, list[float]], names: list[str] = NAMES, **more: float) -> dict[str, Any]:
    return {"names": names, "points": points, **more}


ORDER = sorted(range(7), key=lambda index: NAMES[index])

RUNS = {
    "reached": [goal((1.0, READY), (3.0, ASIDE))],
    "another order": [goal((1.0, [ASIDE[index] for index in ORDER]), names=[NAMES[index] for index in ORDER])],
    "called off": [goal((60.0, READY), cancel=0.5)],
    "another": [goal((60.0, READY), leave=1.0), goal((1.0, READY))],
    "six joints": [goal((1.0, READY[:6]), names=NAMES[:6])],
    "an unknown joint": [goal((1.0, READY), names=[*NAMES[:6], "seventh_joint"])],
    "path left": [goal((0.1, [2.0, *READY[1:]]), tolerance=0.01)],
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> dict[str, list[dict[str, Any]]]:
    """Outcomes of the goals, by run."""
    with ground(tmp_path_factory.mktemp("action"), ros1_messages) as made:
        made.serve("lesson", "-d", "--speed", "2")
        found: dict[str, list[dict[str, Any]]] = made.client(act, RUNS).value()
    return found


Results = dict[str, list[dict[str, Any]]]


def test_goal_is_reached_with_feedback_at_10_hz(results: Results) -> None:
    (result,) = results["reached"]
    assert (result["state"], result["code"]) == (SUCCEEDED, 0)
    stamps = result["stamps"]
    assert len(stamps) >= 28
    assert [later - earlier for earlier, later in pairwise(stamps)] == pytest.approx([0.1] * (len(stamps) - 1))
    assert result["desired"] == pytest.approx(ASIDE, abs=0.1)


def test_goal_with_joints_in_other_order_succeeds(results: Results) -> None:
    (result,) = results["another order"]
    assert (result["state"], result["code"]) == (SUCCEEDED, 0)


def test_cancelled_goal_is_preempted(results: Results) -> None:
    (result,) = results["called off"]
    assert result["state"] == PREEMPTED


def test_goal_replaced_by_other_is_preempted(results: Results) -> None:
    first, second = results["another"]
    assert first["state"] == PREEMPTED
    assert (second["state"], second["code"]) == (SUCCEEDED, 0)


@pytest.mark.parametrize(
    ("run", "code"),
    [("six joints", INVALID_JOINTS), ("an unknown joint", INVALID_JOINTS)],
    ids=["six joints", "an unknown joint"],
)
def test_invalid_goal_is_rejected_with_code(results: Results, run: str, code: int) -> None:
    (result,) = results[run]
    assert (result["state"], result["code"]) == (REJECTED, code)


def test_goal_that_leaves_path_tolerance_is_aborted(results: Results) -> None:
    """Five metres in a tenth of a second are too much for the rail, and violate the tolerance at once."""
    (result,) = results["path left"]
    assert (result["state"], result["code"]) == (ABORTED, PATH_TOLERANCE_VIOLATED)


def cancel_at_once(count: int, positions: list[list[float]]) -> dict[str, Any]:
    """Send goals, and cancel each at once; return the server's final states, and how far each moved the rail [m].

    Goals go to the positions in turn, in 5 s each. The client's own state may be LOST, with any server: a status
    message that was on its way does not list the goal yet.
    """
    import actionlib
    import rospy
    from control_msgs.msg import (
        FollowJointTrajectoryAction,
        FollowJointTrajectoryActionResult,
        FollowJointTrajectoryGoal,
    )
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectoryPoint

    rospy.init_node("hasty")
    rail: list[float] = []
    name = "linear_arm_actuator_joint"

    def note(state: Any) -> None:
        rail.append(state.position[state.name.index(name)])

    results: list[Any] = []
    rospy.Subscriber("/ariac/joint_states", JointState, note)
    rospy.Subscriber("/ariac/arm/follow_joint_trajectory/result", FollowJointTrajectoryActionResult, results.append)
    client = actionlib.SimpleActionClient("/ariac/arm/follow_joint_trajectory", FollowJointTrajectoryAction)
    assert client.wait_for_server()
    wait_until(lambda: rail, "joint states")
    moved = []
    for number in range(count):
        before = rail[-1]
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = [
            "linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
            "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
        ]  # fmt: skip
        point = JointTrajectoryPoint(positions=positions[number % len(positions)])
        point.time_from_start = rospy.Duration(5.0)
        goal.trajectory.points.append(point)
        client.send_goal(goal)
        client.cancel_goal()
        wait_until(lambda: len(results) > number, "result")  # noqa: B023 - called at once
        moved.append(abs(rail[-1] - before))
    return {"states": [each.status.status for each in results], "moved": moved}


def test_goals_that_are_cancelled_at_once_do_not_move_arm(tmp_path: Path, ros1_messages: Path) -> None:
    """Goal and cancellation come on two connections, in any order."""
    with ground(tmp_path, ros1_messages) as made:
        made.serve("lesson", "-d")
        found = made.client(cancel_at_once, 40, [ASIDE, [-0.5, *ASIDE[1:]]]).value()
    assert len(found["states"]) == 40
    assert set(found["states"]) <= {RECALLED, PREEMPTED}
    assert max(found["moved"]) < 0.1  # of 0.5 m and more
