"""Robot in a cell over ROS 1: a rospy program has the topics of both at one time."""

from pathlib import Path
from typing import Any

import pytest

from tests.cell.robot_cells import AT_BIN
from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


def program() -> dict[str, Any]:
    import rospy
    import tf2_ros
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("team")
    states: list[Any] = []
    times: list[Any] = []
    rospy.Subscriber("/left/joint_states", JointState, states.append)
    rospy.Subscriber("/clock", Clock, times.append)
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    commands = rospy.Publisher("/left/joint_cmd", JointState, queue_size=10)
    wait_until(lambda: states and commands.get_num_connections(), "the robot's topics")

    def lift() -> float:
        commands.publish(JointState(name=["lift"], position=[0.2]))
        return float(states[-1].position[states[-1].name.index("lift")])

    wait_until(lambda: abs(lift() - 0.2) < 1e-3, "the lift at its target")
    wait_until(lambda: buffer.can_transform("world", "tandem_right_tip", rospy.Time()), "frames of the robot")
    rospy.wait_for_service("/ariac/start_competition")
    return {
        "is_home": rospy.ServiceProxy("/left_reset_robot", Trigger)().success,
        "starts": rospy.ServiceProxy("/ariac/start_competition", Trigger)().success,
        "apart": abs((times[-1].clock - states[-1].header.stamp).to_sec()),
        "listener": listener is not None,
        "described": 'name="tandem_right_tip"' in rospy.get_param("/left/robot_description"),
        "publishers": [name for name, _ in rospy.get_published_topics() if name.startswith("/left")],
    }


def test_program_drives_robot_beside_the_cell(master: Ground, tmp_path: Path) -> None:
    cell = tmp_path / "cell.yaml"
    cell.write_text(AT_BIN)
    master.serve(str(cell), "-d")
    found = master.client(program).value()
    assert (found["is_home"], found["starts"]) == (True, True)
    assert found["apart"] < 1.0
    assert (found["listener"], found["described"]) == (True, True)
    assert {"/left/joint_states", "/left/applied_joint_cmd", "/left/status"} <= {*found["publishers"]}
