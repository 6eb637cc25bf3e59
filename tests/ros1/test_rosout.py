"""Reasons on /rosout: what a robot refuses or ignores, as tools of ROS 1 show it."""

from __future__ import annotations

from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]
pytestmark = pytest.mark.ros1

COMMANDS = "/io_teleop/joint_cmd"


def err() -> list[Any]:
    """Send invalid messages, and one with an unknown joint; return node and text of the warnings."""
    import rospy
    from rosgraph_msgs.msg import Log
    from sensor_msgs.msg import JointState

    rospy.init_node("clumsy")
    heard: list[Any] = []
    rospy.Subscriber("/rosout", Log, heard.append)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=10)

    def warnings() -> list[Any]:
        return [[each.name, each.msg] for each in heard if each.level == Log.WARN]

    wait_until(lambda: commands.get_num_connections(), "connection")

    def is_heard() -> bool:
        """Send until /rosout is connected: it is latched, and has the newest line only."""
        commands.publish(JointState(name=["a", "a"], position=[0.0, 0.0]))
        return bool(warnings())

    wait_until(is_heard, "first warning")
    commands.publish(JointState(name=["a"], position=[]))
    commands.publish(JointState(name=["right_elbow"], position=[float("nan")]))
    commands.publish(JointState(name=["elbow"], position=[0.0]))
    wait_until(lambda: any("ignored" in text for _, text in warnings()), "line about the unknown joint", seen=warnings)
    return warnings()


def test_reasons_reach_rosout_with_their_sender_and_are_all_said(master: Ground) -> None:
    master.teleop("tandem")
    warnings = master.client(err).value()
    assert {node for node, _ in warnings} == {"/sim_robot_controller_node"}
    texts = [text for _, text in warnings]
    for expected in (
        f"refused {COMMANDS} from /clumsy: 'a' appears twice; give each name once",
        f"refused {COMMANDS} from /clumsy: name and position must have the same length (got 1 and 0)",
        f"refused {COMMANDS} from /clumsy: the position of 'right_elbow' must be finite (got nan)",
        f"{COMMANDS}: 'elbow' is not a joint of this robot; ignored (logged once)",
    ):
        assert any(text.startswith(expected) for text in texts), texts
