"""Cell with two arms over ROS 1: a rospy program commands both, each in its namespace."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]
pytestmark = pytest.mark.ros1

CELL = Path(__file__).parents[1] / "data" / "two_arms.yaml"


def program() -> dict[str, Any]:
    import rospy
    import tf2_ros
    from osrf_gear.msg import VacuumGripperState
    from osrf_gear.srv import VacuumGripperControl
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rospy.init_node("team")
    states: dict[str, Any] = {}
    suction: dict[str, bool] = {}
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    commands = {}
    for arm in ("arm1", "arm2"):
        rospy.Subscriber(f"/ariac/{arm}/joint_states", JointState, lambda m, arm=arm: states.update({arm: m}))
        rospy.Subscriber(
            f"/ariac/{arm}/gripper/state", VacuumGripperState, lambda m, arm=arm: suction.update({arm: m.enabled})
        )
        commands[arm] = rospy.Publisher(f"/ariac/{arm}/arm/command", JointTrajectory, queue_size=1)
    wait_until(lambda: len(states) == 2 and all(each.get_num_connections() for each in commands.values()), "both arms")

    def rail(arm: str) -> float:
        return float(dict(zip(states[arm].name, states[arm].position, strict=True))["linear_arm_actuator_joint"])

    for arm, goal in (("arm1", -1.0), ("arm2", 1.0)):
        names = rospy.get_param(f"/ariac/{arm}/arm/joints")
        now = dict(zip(states[arm].name, states[arm].position, strict=True))
        point = JointTrajectoryPoint(positions=[goal, *(now[name] for name in names[1:])])
        point.time_from_start = rospy.Duration(1.0)
        commands[arm].publish(JointTrajectory(joint_names=names, points=[point]))
    wait_until(lambda: abs(rail("arm1") + 1.0) < 0.02 and abs(rail("arm2") - 1.0) < 0.02, "both arms at their goals")
    rospy.ServiceProxy("/ariac/arm2/gripper/control", VacuumGripperControl)(True)
    wait_until(lambda: suction.get("arm2"), "suction of the second arm")
    wait_until(lambda: buffer.can_transform("arm1_forearm_link", "arm2_forearm_link", rospy.Time()), "frames")
    return {"first": suction["arm1"], "listener": listener is not None}


def test_rospy_program_commands_both_arms(master: Ground) -> None:
    master.serve(str(CELL), "-d")
    assert master.client(program).value() == {"first": False, "listener": True}
