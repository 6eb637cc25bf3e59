"""The tree of frames in ROS 1: the arm's from ROS's own robot_state_publisher, the cameras' from the cell."""

from __future__ import annotations

import operator
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.interface.parameters import robot_description
from cellwright.cli import options
from tests.cell.interface.urdf_chain import joints_of, world_T
from tests.ros1.ground import Ground, ground
from tests.support.processes import Process

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

PUBLISHER = "/robot_state_publisher"
SECONDS = 2.0
CHAIN = {
    "base_link": "linear_arm_actuator",
    "shoulder_link": "base_link",
    "upper_arm_link": "shoulder_link",
    "forearm_link": "upper_arm_link",
    "wrist_1_link": "forearm_link",
    "wrist_2_link": "wrist_1_link",
    "wrist_3_link": "wrist_2_link",
    "vacuum_gripper_link": "wrist_3_link",
}
FIXED = {
    **{f"bin{number}_frame": "world" for number in range(1, 9)},
    **{f"agv{number}_load_point_frame": "world" for number in (1, 2)},
    "belt_frame": "world",
    "break_beam_frame": "world",
    "proximity_sensor_frame": "world",
    "laser_profiler_frame": "world",
    "linear_arm_actuator": "world",
    "base": "base_link",
    "ee_link": "wrist_3_link",
    "tool0": "wrist_3_link",
}


def listen(seconds: float) -> object:
    """Return messages of /tf and /tf_static in some simulation time [s]: by sender, (child, parent, stamp [ns])."""
    import rospy
    from tf2_msgs.msg import TFMessage

    heard: Any = {"/tf": {}, "/tf_static": {}}

    def take(message: object, topic: str) -> None:
        came: Any = message
        sender = came._connection_header["callerid"]
        heard[topic].setdefault(sender, []).append(
            [[each.child_frame_id, each.header.frame_id, each.header.stamp.to_nsec()] for each in came.transforms]
        )

    rospy.init_node("listener")
    for topic in heard:
        rospy.Subscriber(topic, TFMessage, take, topic)
    rospy.sleep(seconds)
    return heard


@pytest.fixture(scope="module")
def text() -> str:
    return robot_description(options.load(["lesson"]))


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[tuple[Ground, Process]]:
    """A master and the lesson's cell."""
    with ground(tmp_path_factory.mktemp("frames"), ros1_messages) as made:
        yield made, made.serve("lesson")


def test_frames_have_parent_sender_and_rate_of_original(served: tuple[Ground, Process]) -> None:
    master, cell = served
    heard = master.client(listen, SECONDS).value()
    assert heard["/tf_static"].keys() == {PUBLISHER}
    (static,) = heard["/tf_static"][PUBLISHER]
    assert {child: parent for child, parent, _ in static} == FIXED
    assert heard["/tf"].keys() == {PUBLISHER, "/gazebo"}
    for message in heard["/tf"][PUBLISHER]:
        assert {child: parent for child, parent, _ in message} == CHAIN
    cameras = {child: parent for message in heard["/tf"]["/gazebo"] for child, parent, _ in message}
    assert cameras["logical_camera_frame"] == "world"
    assert cameras["logical_camera_over_agv1_agv1_frame"] == "logical_camera_over_agv1_frame"
    assert not cameras.keys() & (CHAIN.keys() | FIXED.keys())
    stamps = sorted(message[0][2] for message in heard["/tf"][PUBLISHER])
    assert len(stamps) > 2
    # a multiple if robot_state_publisher was busy: it skips joint states when it has no time
    gaps = [round(gap / 1e6, 3) for gap in map(operator.sub, stamps[1:], stamps)]
    assert min(gaps) == 20.0
    assert all(gap % 20.0 == 0.0 for gap in gaps)
    assert not re.search(r"robot_state_publisher: \[", cell.out + cell.err)  # it reports no problem


def test_tf_echo_prints_transform(served: tuple[Ground, Process], text: str) -> None:
    master, _ = served
    echo = master.start(["rosrun", "tf", "tf_echo", "world", "vacuum_gripper_link"])
    found = echo.wait_for(r"Translation: \[(.*), (.*), (.*)\]")
    echo.interrupt()
    initial = dict(zip((joint.name for joint in joints_of(text) if joint.kind != "fixed"),
                       (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0), strict=False))  # fmt: skip
    expected = world_T(text, "vacuum_gripper_link", initial)[:3, 3]
    assert [float(each) for each in found.groups()] == pytest.approx(expected, abs=0.02)  # the soft servos sag


def test_cell_without_arm_publishes_fixed_frames(master: Ground, tmp_path: Any) -> None:
    file = tmp_path / "bare.yaml"
    file.write_text("options:\n  insert_agvs: true\n")
    cell = master.serve(str(file))
    heard = master.client(listen, 1.0).value()
    (static,) = heard["/tf_static"][PUBLISHER]
    assert {parent for _, parent, _ in static} == {"world"}
    assert len(static) == 11
    assert PUBLISHER not in heard["/tf"]
    assert not re.search(r"robot_state_publisher: \[|error", cell.out + cell.err)
