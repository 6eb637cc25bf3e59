"""Robot in a cell over ROS 2: an rclpy program has the topics of both at one time."""

from pathlib import Path
from typing import Any

import pytest

from tests.cell.robot_cells import AT_BIN
from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]

pytestmark = pytest.mark.ros2


def program() -> dict[str, Any]:
    from rclpy_node import Node, interface

    with Node() as me:
        states = me.listen("/left/joint_states", "sensor_msgs/JointState")
        tf = me.listen("/tf", "tf2_msgs/TFMessage")
        commands = me.node.create_publisher(interface("sensor_msgs/JointState"), "/left/joint_cmd", 10)
        me.wait(lambda: states and commands.get_subscription_count(), "the robot's topics")

        def lift() -> float:
            message = interface("sensor_msgs/JointState")()
            message.name, message.position = ["lift"], [0.2]
            commands.publish(message)
            return float(states[-1].position[states[-1].name.index("lift")])

        me.wait(lambda: abs(lift() - 0.2) < 1e-3, "the lift at its target")
        me.wait(lambda: tf, "frames")
        wanted = ["left.robot_description"]
        (described,) = me.call("/cellwright/get_parameters", "rcl_interfaces/GetParameters", names=wanted).values
        return {
            "frames": [each.child_frame_id for each in tf[-1].transforms],
            "described": 'name="tandem_right_tip"' in described.string_value,
            "is_home": me.call("/left_reset_robot", "std_srvs/Trigger").success,
            "starts": me.call("/ariac/start_competition", "std_srvs/Trigger").success,
            "names": [name for name, _ in me.node.get_topic_names_and_types() if name.startswith("/left")],
        }


def test_program_drives_robot_beside_the_cell(domain: Ground, tmp_path: Path) -> None:
    cell = tmp_path / "cell.yaml"
    cell.write_text(AT_BIN)
    domain.serve(str(cell), "-d")
    found = domain.client(program).value()
    assert (found["is_home"], found["starts"], found["described"]) == (True, True, True)
    assert "tandem_right_hand" in found["frames"]
    assert {"/left/joint_states", "/left/applied_joint_cmd", "/left/status"} <= {*found["names"]}
