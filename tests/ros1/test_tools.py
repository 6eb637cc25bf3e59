"""ROS's standard tools, unmodified, with a served cell."""

import itertools
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from cellwright.middleware.messages.standard import JointState
from tests.ros1.glance import glance
from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

COMMAND = """
{joint_names: [elbow_joint, linear_arm_actuator_joint, shoulder_lift_joint, shoulder_pan_joint, wrist_1_joint,
  wrist_2_joint, wrist_3_joint],
 points: [{time_from_start: {secs: 1}, positions: [2.5, 0.3, -1.2, 3.2, 3.5, -1.51, 0.0, 0.0]}]}
"""
"""Command of the lesson: seven names, eight positions, in the order of the joint states."""

PACKAGE = """
<package format="2"><name>listener</name><version>1.0.0</version><description>listens</description>
<maintainer email="user@localhost">user</maintainer><license>none</license></package>
"""
LAUNCH = """
<launch>
  <arg name="topic" default="joint_states"/>
  <param name="answer" value="42" type="int"/>
  <node pkg="listener" type="look" name="listener" output="screen" args="$(arg topic)" ns="ariac" required="true">
    <remap from="state" to="competition_state"/>
  </node>
</launch>
"""
NODE = """#!/usr/bin/python3
import sys, rospy
from std_msgs.msg import String
rospy.init_node("look")
print(rospy.get_name(), rospy.get_param("/answer"), sys.argv[1], rospy.wait_for_message("state", String).data)
"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """The lesson in development mode, beside a whole roscore.

    Time passes slowly: the tools take seconds to start, and a cell at full speed would waste processor time.
    """
    with ground(tmp_path_factory.mktemp("tools"), ros1_messages, roscore=True) as made:
        made.serve("lesson", "-d", "--speed", "0.4")
        yield made


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.\d+", text)]


def test_rostopic_list_shows_topics(cell: Ground) -> None:
    topics = cell.tool("rostopic", "list").split()
    assert {"/clock", "/tf", "/tf_static", "/ariac/joint_states", "/ariac/arm/command", "/ariac/orders"} < set(topics)
    assert "Published topics" in cell.tool("rostopic", "list", "-v")


def test_rostopic_type_prints_type(cell: Ground) -> None:
    assert cell.tool("rostopic", "type", "/ariac/logical_camera") == "osrf_gear/LogicalCameraImage\n"


def test_rostopic_info_names_nodes(cell: Ground) -> None:
    said = cell.tool("rostopic", "info", "/ariac/joint_states")
    assert "Type: sensor_msgs/JointState" in said
    assert re.search(r"Publishers: \n \* /gazebo ", said)
    assert re.search(r"Subscribers: \n \* /robot_state_publisher ", said)


def test_rostopic_echo_prints_messages(cell: Ground) -> None:
    assert 'data: "init"' in cell.tool("rostopic", "echo", "-n", "1", "/ariac/competition_state")
    said = cell.tool("rostopic", "echo", "-n", "1", "/ariac/joint_states")
    assert said.index("elbow_joint") < said.index("linear_arm_actuator_joint") < said.index("vacuum_gripper_joint")
    camera = cell.tool("rostopic", "echo", "-n", "1", "/ariac/logical_camera")
    assert 'type: "piston_rod_part"' in camera
    assert "linear_arm" in cell.tool("rostopic", "echo", "-n", "1", "/ariac/arm/state/joint_names")
    assert "logical_camera_frame" in cell.tool(
        "rostopic", "echo", "-n", "1", "--filter", "m.transforms[0].child_frame_id.startswith('logical')", "/tf"
    )


def test_rostopic_echo_prints_simulation_times(cell: Ground) -> None:
    """The columns of -p are for plots: the times of arrival and of the header are simulation time."""
    lines = cell.tool("rostopic", "echo", "-p", "-n", "3", "/ariac/joint_states").splitlines()
    assert lines[0].startswith("%time,field.header.seq,field.header.stamp")
    rows = [line.split(",") for line in lines[1:]]
    stamps = [int(row[2]) for row in rows]
    assert [b - a for a, b in itertools.pairwise(stamps)] == [20_000_000] * 2
    seqs = [int(row[1]) for row in rows]
    assert [b - a for a, b in itertools.pairwise(seqs)] == [1, 1]
    for row in rows:
        assert abs(int(row[0]) - int(row[2])) < TIMEOUT * 1e9, "the wall's time is 50 years ahead"


def test_rostopic_hz_prints_rate(cell: Ground) -> None:
    hz = cell.start(["rostopic", "hz", "/ariac/joint_states"])
    found = hz.wait_for(r"average rate: (\S+)")
    assert float(found[1]) > 0.0  # the number in time depends on the machine; test_contract counts them
    hz.interrupt()


def test_rostopic_bw_prints_bandwidth(cell: Ground) -> None:
    bw = cell.start(["rostopic", "bw", "/ariac/laser_profiler"])
    found = bw.wait_for(r"average: (\S+)KB/s\s+mean: (\S+)KB")
    assert 1.6 < float(found[2]) < 3.6  # 400 floats, and 400 more if there are intensities
    bw.interrupt()


def test_rostopic_delay_is_in_simulation_time(cell: Ground) -> None:
    delay = cell.start(["rostopic", "delay", "/ariac/joint_states"])
    found = delay.wait_for(r"average delay: (\S+)")
    assert abs(float(found[1])) < TIMEOUT, "the wall's time is 50 years ahead"
    delay.interrupt()


def test_rostopic_pub_moves_the_arm(cell: Ground) -> None:
    def lift() -> float:
        return float(glance(cell, "/ariac/joint_states", JointState)[0].position[2])

    said = cell.tool("rostopic", "echo", "-n", "1", "/ariac/joint_states/position[2]")
    assert float(said.splitlines()[0]) == pytest.approx(-1.13, abs=0.02)
    published = cell.tool("rostopic", "pub", "-1", "/ariac/arm/command", "trajectory_msgs/JointTrajectory", COMMAND)
    assert "publishing and latching" in published
    wait_until(lambda: lift() == pytest.approx(-1.2, abs=0.02), "arm where it was sent", seen=lift)
    assert "rejected" not in cell.log()


def test_rosservice_shows_services(cell: Ground) -> None:
    assert {"/ariac/start_competition", "/ariac/agv1"} < set(cell.tool("rosservice", "list").split())
    assert cell.tool("rosservice", "type", "/ariac/agv1") == "osrf_gear/AGVControl\n"
    assert cell.tool("rosservice", "args", "/ariac/agv1") == "kit_type\n"
    assert cell.tool("rosservice", "node", "/ariac/agv1") == "/gazebo\n"
    info = cell.tool("rosservice", "info", "/ariac/gripper/control")
    assert "Type: osrf_gear/VacuumGripperControl" in info
    assert "/ariac/agv1" in cell.tool("rosservice", "find", "osrf_gear/AGVControl")


def test_rosservice_call_prints_response(cell: Ground) -> None:
    places = cell.tool("rosservice", "call", "/ariac/material_locations", "gear_part")
    assert sorted(re.findall(r'unit_id: "(\S+)"', places)) == ["belt", "bin8"]
    assert "success: True" in cell.tool("rosservice", "call", "/ariac/gripper/control", "true")
    assert "enabled: True" in cell.tool("rostopic", "echo", "-n", "1", "/ariac/gripper/state")
    assert "success: True" in cell.tool("rosservice", "call", "/ariac/conveyor/control", "{state: {power: 50}}")


def test_rosservice_lists_controllers(cell: Ground) -> None:
    listed = cell.tool("rosservice", "call", "/ariac/controller_manager/list_controllers")
    assert [line.split(": ")[1].strip('"') for line in listed.splitlines() if " name: " in line] == [
        *("arm", "joint_state_controller")
    ]
    assert "effort_controllers/JointTrajectoryController" in listed


def test_rosservice_call_without_answer_fails(cell: Ground) -> None:
    """In the state `init` no tray can be submitted: the original's server returned false, and so the call failed."""
    said = cell.start(["rosservice", "call", "/ariac/submit_tray", "{tray_id: x, kit_type: y}"])
    assert said.finish() != 0
    assert "ERROR: service [/ariac/submit_tray] responded with an error" in said.out + said.err


def test_rosnode_shows_nodes(cell: Ground) -> None:
    assert set(cell.tool("rosnode", "list").split()) == {"/gazebo", "/robot_state_publisher", "/rosout"}
    info = cell.tool("rosnode", "info", "/gazebo")
    for line in (
        " * /clock [rosgraph_msgs/Clock]",
        " * /ariac/orders [osrf_gear/Order]",
        " * /ariac/arm/command [",
        " * /ariac/start_competition",
        " * topic: /ariac/joint_states\n    * to: /robot_state_publisher",
        " * topic: /ariac/trays\n    * to: /gazebo\n    * direction: outbound\n    * transport: INTRAPROCESS",
    ):
        assert line in info
    for node in ("/gazebo", "/robot_state_publisher"):
        assert "xmlrpc reply from" in cell.tool("rosnode", "ping", "-c", "1", node)


def test_roswtf_finds_no_missing_connection(cell: Ground) -> None:
    said = cell.tool("roswtf")
    assert "Online checks summary:" in said
    assert "should be connected" not in said
    assert "/ariac/arm/command" in said  # as in the original, no node commands the arm yet


def test_rosparam_shows_parameters(cell: Ground) -> None:
    assert cell.tool("rosparam", "get", "/use_sim_time") == "true\n"
    assert cell.tool("rosparam", "get", "/robot_description").lstrip('" |').lstrip().startswith("<")
    gains = cell.tool("rosparam", "get", "/ariac/arm")
    assert "effort_controllers/JointTrajectoryController" in gains
    assert "linear_arm_actuator_joint" in gains


def test_rosbag_records_and_plays(cell: Ground, tmp_path: Path) -> None:
    """Recorded messages can be read, have simulation time, and come again on playback."""
    bag = tmp_path / "cell.bag"
    topics = ["/clock", "/tf_static", "/ariac/joint_states", "/ariac/logical_camera", "/ariac/orders"]
    assert "success: True" in cell.tool("rosservice", "call", "/ariac/start_competition")
    # small chunks, so that messages are in the file soon
    record = cell.start(["rosbag", "record", "-O", str(bag), "--chunksize=1", *topics])
    active = bag.with_suffix(".bag.active")

    def recorded() -> bool:
        found = active.read_bytes() if active.exists() else b""
        words = (b"order_0", b"linear_arm_actuator", b"piston_rod_part")  # an order, a static frame, a camera's part
        return found.count(b"elbow_joint") > 40 and all(word in found for word in words)

    wait_until(recorded, "recorded messages", seen=lambda: record.said)
    assert record.interrupt() == 0
    info = json.dumps(cell.tool("rosbag", "info", str(bag)))
    for topic in topics:
        assert topic in info
    assert "7fadfe9b7f871f7a5285e3dfb4eb98ef" in info

    times = cell.client(read_bag, str(bag)).value()
    assert times["orders"] == ["order_0"]
    stamps = times["stamps"]
    assert len(stamps) > 20
    assert {round(b - a, 6) for a, b in itertools.pairwise(stamps)} == {0.02}
    arrivals = times["arrivals"]
    assert all(abs(a - b) < TIMEOUT for a, b in zip(stamps, arrivals, strict=True)), "the wall's time is 50 years ahead"

    replayed = cell.start(["rostopic", "echo", "-n", "1", "/again"])
    cell.tool(
        "rosbag",
        "play",
        "--quiet",
        "--rate=4",
        "--wait-for-subscribers",
        str(bag),
        "--topics",
        "/ariac/joint_states",
        "/ariac/joint_states:=/again",
    )
    assert replayed.finish() == 0
    assert "elbow_joint" in replayed.out


def read_bag(path: str) -> dict[str, list[object]]:
    import rosbag

    with rosbag.Bag(path) as bag:
        states = [
            (message.header.stamp.to_sec(), time.to_sec())
            for _, message, time in bag.read_messages("/ariac/joint_states")
        ]
        orders = [message.order_id for _, message, _ in bag.read_messages("/ariac/orders")]
    return {"stamps": [state[0] for state in states], "arrivals": [state[1] for state in states], "orders": orders}


def test_tf_echo_prints_simulated_frames(cell: Ground) -> None:
    echo = cell.start(["rosrun", "tf", "tf_echo", "world", "linear_arm_actuator"])
    said = echo.wait_for(r"Translation: \[(.*)\]")
    assert numbers(said[1]) == [0.3, 0.0, 0.9]
    echo.interrupt()
    camera = cell.start(["rosrun", "tf", "tf_echo", "world", "logical_camera_frame"])
    assert numbers(camera.wait_for(r"Translation: \[(.*)\]")[1]) == [-0.66, 0.22, 1.36]
    camera.interrupt()


def package(folder: Path) -> str:
    """Write a user's package; return the search path that contains it."""
    for name, text, mode in (("package.xml", PACKAGE, 0o644), ("look.launch", LAUNCH, 0o644), ("look", NODE, 0o755)):
        path = folder / "listener" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        path.chmod(mode)
    return f"{folder}:/usr/share"


def test_roslaunch_passes_parameters_and_remapping(cell: Ground, tmp_path: Path) -> None:
    """Parameters, namespaces, remapping and arguments; the launch ends with the node."""
    launched = cell.start(["roslaunch", "listener", "look.launch", "topic:=orders"], ROS_PACKAGE_PATH=package(tmp_path))
    launched.wait_for(r"^/ariac/listener 42 orders (init|go)$")
    assert launched.finish() == 0
    assert "ariac/listener" not in cell.tool("rosnode", "list")


def test_rosrun_passes_arguments_and_remapping(cell: Ground, tmp_path: Path) -> None:
    cell.tool("rosparam", "set", "/answer", "43")
    said = cell.tool(
        "rosrun", "listener", "look", "here", "state:=/ariac/competition_state", ROS_PACKAGE_PATH=package(tmp_path)
    )
    assert said.split()[:3] == ["/look", "43", "here"]
