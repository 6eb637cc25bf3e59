"""Bridge process: its registrations, and its end in all cases."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, heard, out, service
from tests.middleware.ros1.bridge.wire import Calls, subscribe
from tests.ros1.ground import Ground
from tests.ros1.listening import addresses
from tests.ros1.requirement import ros_python
from tests.support.processes import name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]

URDF = """<robot name="cell"><link name="world"/><link name="bin1_frame"/><link name="rail"/>
<joint name="fixed" type="fixed"><parent link="world"/><child link="bin1_frame"/><origin xyz="1 2 3"/></joint>
<joint name="linear_arm_actuator_joint" type="prismatic"><parent link="world"/><child link="rail"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""
PROGRAM = "/usr/lib/robot_state_publisher/robot_state_publisher"

LATE_LISTENER = """
import time
import rospy
rospy.init_node("robot_state_publisher")
frames = rospy.Publisher("/tf_static", rospy.AnyMsg, queue_size=1, latch=True)
time.sleep(1.0)  # late on purpose: it must be waited for
states = rospy.Subscriber("joint_states", rospy.AnyMsg, lambda message: None)
rospy.spin()
"""

TOPICS = [
    out("/clock", "rosgraph_msgs/Clock"),
    out("/ariac/joint_states", "sensor_msgs/JointState"),
    out("/ariac/gripper/state", "osrf_gear/VacuumGripperState"),
    out("/ariac/trays", "osrf_gear/TrayContents"),
    out("/ariac/orders", "osrf_gear/Order", latch=True, on_event=True),
    out("/tf", "tf2_msgs/TFMessage", publishers=["/robot_state_publisher", "/gazebo"]),
    out("/tf_static", "tf2_msgs/TFMessage", publishers=["/robot_state_publisher"], latch=True, on_event=True),
    heard("/ariac/arm/command", "trajectory_msgs/JointTrajectory"),
]
SERVICES = [service("/ariac/start_competition")]


@pytest.fixture
def cell(make_cell: MakeCell) -> FakeCell:
    return make_cell(TOPICS, SERVICES)


def graph(master: Ground) -> list[dict[str, list[str]]]:
    """Return nodes by topic: publishers, subscribers; and by service."""
    own = ("/rosout", "/gazebo/", "/robot_state_publisher/")
    return [
        {name: sorted(nodes) for name, nodes in role if not name.startswith(own)}
        for role in master.ask("getSystemState")
    ]


def is_registered(master: Ground) -> bool:
    return any(nodes for role in graph(master) for nodes in role.values())


def test_graph_with_robot_state_publisher_matches_original(master: Ground, cell: FakeCell) -> None:
    master.ask("setParam", "robot_description", URDF)
    bridge = start_bridge(master, cell, frames=PROGRAM, cold=True)
    publishers, subscribers, services = graph(master)
    assert publishers == {
        "/clock": ["/gazebo"],
        "/ariac/joint_states": ["/gazebo"],
        "/ariac/gripper/state": ["/gazebo"],
        "/ariac/trays": ["/gazebo"],
        "/ariac/orders": ["/gazebo"],
        "/tf": ["/gazebo", "/robot_state_publisher"],
        "/tf_static": ["/robot_state_publisher"],
    }
    assert subscribers == {
        "/ariac/joint_states": ["/robot_state_publisher"],
        "/ariac/gripper/state": ["/gazebo"],
        "/ariac/trays": ["/gazebo"],
        "/ariac/arm/command": ["/gazebo"],
    }
    assert services == {"/ariac/start_competition": ["/gazebo"]}
    subscribe(master, "/tf")
    cell.wait_for_listener("/tf")
    (frame,) = [frame for frame in cell.of(FrameKind.SUBSCRIBE) if frame.name == "/tf"]
    assert frame.node == "/gazebo"
    assert 'child_frame_id: "bin1_frame"' in master.tool("rostopic", "echo", "-n", "1", "/tf_static")
    bridge.signal(signal.SIGINT)
    assert bridge.finish() == 0
    assert not is_registered(master)
    wait_until(lambda: not bridge.relatives(), "end of its child")


def test_bridge_is_ready_when_robot_state_publisher_subscribes(master: Ground, cell: FakeCell, tmp_path: Path) -> None:
    """robot_state_publisher registers its frames before it subscribes; programs that count subscribers must wait."""
    program = tmp_path / "late_listener"
    program.write_text(f"#!{ros_python()}\n{LATE_LISTENER}")
    program.chmod(0o755)
    start_bridge(master, cell, frames=str(program))
    assert graph(master)[1]["/ariac/joint_states"] == ["/robot_state_publisher"]


def test_bridge_names_ignore_ros_namespace(master: Ground, cell: FakeCell) -> None:
    """A namespace of the shell, or of a group in a launch file, does not change them."""
    master.ask("setParam", "robot_description", URDF)
    bridge = start_bridge(master, cell, frames=PROGRAM, ROS_NAMESPACE="/group")
    publishers, _, services = graph(master)
    assert publishers["/tf"] == ["/gazebo", "/robot_state_publisher"]
    assert services == {"/ariac/start_competition": ["/gazebo"]}
    assert master.ask("hasParam", "/robot_state_publisher/publish_frequency")
    assert "new ROS master" not in bridge.said


def test_bridge_with_own_name_in_namespace_registers_it(master: Ground, cell: FakeCell) -> None:
    start_bridge(master, cell, "--name", "/left/gazebo", ROS_NAMESPACE="/group")
    assert graph(master)[2]["/ariac/start_competition"] == ["/left/gazebo"]


def test_graph_without_robot_state_publisher_matches_original(master: Ground, cell: FakeCell) -> None:
    start_bridge(master, cell)
    publishers, subscribers, _ = graph(master)
    assert publishers["/tf"] == publishers["/tf_static"] == ["/gazebo"]
    assert subscribers["/ariac/joint_states"] == ["/gazebo"]


def test_robot_state_publisher_that_ends_is_restarted(master: Ground, cell: FakeCell) -> None:
    master.ask("setParam", "robot_description", URDF)
    bridge = start_bridge(master, cell, frames=PROGRAM)
    (child,) = [pid for pid in bridge.relatives() if "robot_state_publisher" in name_of(pid)]
    os.kill(child, signal.SIGKILL)
    bridge.wait_for("robot_state_publisher ended with status -9; restarting it in 2 s")
    wait_until(lambda: any(pid != child for pid in bridge.relatives()), "second one")


def test_bridge_without_robot_description_warns_and_goes_on(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell, frames=PROGRAM)
    bridge.wait_for("the frames of the arm are missing until it does")
    bridge.wait_for("robot_state_publisher: .*robot_description")
    assert Calls(master, "/ariac/start_competition").call(b"")[0]


def test_bridge_is_ready_when_all_is_registered(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    assert bridge.out == "ready\n"
    assert bridge.err == ""
    assert graph(master)[0]["/clock"] == ["/gazebo"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_bridge_and_unregisters(number: int, master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    subscribe(master, "/ariac/joint_states")
    bridge.signal(number)
    assert bridge.finish() == 0
    assert not is_registered(master)
    assert bridge.err == ""


def test_signal_during_start_ends_bridge(master: Ground, cell: FakeCell) -> None:
    for delay in (0.1, 0.2, 0.3, 0.4, 0.5, 0.7):
        bridge = start_bridge(master, cell, frames=PROGRAM, ready=False, cold=True)
        time.sleep(delay)  # noqa: TID251 - no condition: the signal is to meet any moment
        bridge.signal(signal.SIGTERM)
        assert bridge.finish() in (0, -signal.SIGTERM)  # Python itself may not have started yet
        assert "Traceback" not in bridge.err
        wait_until(lambda bridge=bridge: not bridge.relatives(), "end of its child")  # type: ignore[misc]


def test_bridge_ends_with_cell(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    cell.send(Frame(FrameKind.ENDED, payload=b"the run is over"))
    assert bridge.finish() == 0
    assert bridge.err == ""
    assert not is_registered(master)


def test_bridge_ends_when_connection_to_cell_is_lost(master: Ground, cell: FakeCell) -> None:
    master.ask("setParam", "robot_description", URDF)
    bridge = start_bridge(master, cell, frames=PROGRAM)
    cell.hang_up()
    assert bridge.finish() == 0
    assert bridge.err.splitlines()[-1] == "the cell is gone"
    wait_until(lambda: not bridge.relatives(), "end of its child")


def test_bridge_ends_on_invalid_data_from_cell(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    cell.send_bytes(b"\xff" * 100)
    assert bridge.finish() == 0
    assert "invalid data from the cell" in bridge.err


def test_bridge_started_after_kill_takes_over_name(master: Ground, cell: FakeCell) -> None:
    first = start_bridge(master, cell, frames=PROGRAM)
    first.signal(signal.SIGKILL)
    first.finish()
    wait_until(lambda: not first.relatives(), "end of its child")
    start_bridge(master, cell)
    orders = subscribe(master, "/ariac/orders")
    cell.say("/ariac/orders", TYPES.to_ros1(String("x")))
    assert orders.piece()
    assert Calls(master, "/ariac/start_competition").call(b"")[0]


def test_bridge_ends_when_other_node_takes_name(master: Ground, cell: FakeCell, make_cell: MakeCell) -> None:
    first = start_bridge(master, cell)
    start_bridge(master, make_cell(TOPICS, SERVICES))
    assert first.finish() == 0
    assert Calls(master, "/ariac/start_competition").call(b"")[0]


def test_bridge_registers_again_at_returning_master(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    joints = subscribe(master, "/ariac/joint_states")
    master.stop_master(signal.SIGKILL)
    bridge.wait_for("the ROS master at .* is gone, with all parameters")
    cell.say("/ariac/joint_states", bytes(20))
    assert joints.piece()  # existing connections go on
    master.start_master()
    assert bridge.finish() == 75
    assert "a new ROS master answers" in bridge.err
    assert "Traceback" not in bridge.err
    start_bridge(master, cell)


def test_bridge_registers_again_at_master_restarted_unseen(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    master.stop_master(signal.SIGKILL)
    master.start_master()
    assert bridge.finish() == 75


def test_bridge_keeps_registrations_at_stopped_master(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    assert master.process is not None
    master.process.signal(signal.SIGSTOP)
    bridge.wait_for("is gone")
    master.process.signal(signal.SIGCONT)
    bridge.wait_for("answers again and still knows all registrations")
    assert Calls(master, "/ariac/start_competition").call(b"")[0]


def test_bridge_ends_in_time_with_stopped_master(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell)
    assert master.process is not None
    master.process.signal(signal.SIGSTOP)
    bridge.signal(signal.SIGINT)
    assert bridge.finish() == 0
    master.process.signal(signal.SIGCONT)


def test_bridge_without_master_prints_error(no_master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(no_master, cell, ready=False)
    assert bridge.finish() == 1
    assert bridge.err.startswith(f"no ROS master answers at {no_master.uri}")
    assert len(bridge.err.splitlines()) == 1


def test_bridge_without_cell_prints_error(master: Ground, cell: FakeCell) -> None:
    cell.close()
    bridge = start_bridge(master, cell, ready=False)
    assert bridge.finish() == 1
    assert bridge.err.startswith(f"no cell answers at {cell.address}")


def test_bridge_with_other_program_at_address_prints_error(master: Ground, cell: FakeCell) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        cell.address = f"127.0.0.1:{listener.getsockname()[1]}"
        bridge = start_bridge(master, cell, ready=False)
        connection, _ = listener.accept()
        with connection:
            connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            assert bridge.finish() == 1
    assert bridge.err.startswith(f"the program at {cell.address} is not a cell")


def test_bridge_listens_on_loopback_if_master_does(master: Ground, cell: FakeCell) -> None:
    bridge = start_bridge(master, cell, ROS_IP="")
    assert addresses(bridge.pid) == {"127.0.0.1"}


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", ":5"])
def test_bridge_with_invalid_address_is_refused(address: str, no_master: Ground, cell: FakeCell) -> None:
    cell.address = address
    bridge = start_bridge(no_master, cell, ready=False)
    assert bridge.finish() == 2
    assert "is not an address; write it like 127.0.0.1:11399" in bridge.err
