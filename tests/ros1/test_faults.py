"""Errors of clients: the cell reports each in a line, keeps its pace, and serves the next client."""

import signal
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.messages.standard import JointState
from tests.ros1.glance import answer, glance
from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """A cell for all bad clients, one after the other; it must work to the end."""
    with ground(tmp_path_factory.mktemp("faults"), ros1_messages) as made:
        made.serve("lesson", "-d")
        yield made


def assert_well(cell: Ground) -> None:
    """Check that it answers, and that time passes: joint states every 20 ms of simulation, none missing."""
    assert answer(cell, "/ariac/gripper/control", b"\0") == b"\1"
    states = glance(cell, "/ariac/joint_states", JointState, 51)
    stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in states]
    assert {later - earlier for earlier, later in pairwise(stamps)} == {20_000_000}


def call_and_die(service: str, count: int) -> None:
    """Call a service, and disconnect before the answer."""
    import os
    import signal
    import threading
    import time

    import rospy
    import rosservice

    rospy.init_node("short_lived", anonymous=True)
    rospy.wait_for_service(service, TIMEOUT)
    kind = rosservice.get_service_class_by_name(service)
    proxies = [rospy.ServiceProxy(service, kind) for _ in range(count)]
    for proxy in proxies:
        threading.Thread(target=proxy, daemon=True).start()
    time.sleep(moment := int.from_bytes(os.urandom(1), "big") / 50_000)  # noqa: TID251 - no condition: any will do
    print("gone after", moment, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def test_client_killed_during_call_leaves_cell_running(cell: Ground) -> None:
    clients = [cell.client(call_and_die, "/ariac/material_locations", 20) for _ in range(3)]
    for client in clients:
        assert client.finish() == -signal.SIGKILL
        assert "gone after" in client.out
    assert_well(cell)


def flood(count: int, calls: int) -> dict[str, float]:
    """Send commands at full speed, until there were enough, and services have answered meanwhile."""
    import threading

    import rospy
    from osrf_gear.srv import VacuumGripperControl
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rospy.init_node("flood", anonymous=True)
    publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=None, tcp_nodelay=True)
    wait_until(publisher.get_num_connections, "connection")
    names = ["elbow", "linear_arm_actuator", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3"]
    message = JointTrajectory(joint_names=[f"{name}_joint" for name in names])
    positions = [1.51, 0.0, -1.13, 3.14, 3.77, -1.51, 0.0]
    message.points = [JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(1.0))]
    wait_until(rospy.get_time, "simulation time")
    begin = rospy.get_time()
    answers: list[bool] = []

    def ask() -> None:
        control = rospy.ServiceProxy("/ariac/gripper/control", VacuumGripperControl, persistent=True)
        while len(answers) < calls:
            answers.append(control(False).success)

    asking = threading.Thread(target=ask)
    asking.start()
    sent = 0
    while sent < count or asking.is_alive() or rospy.get_time() < begin + 1.0:
        publisher.publish(message)
        sent += 1
    return {"sent": sent, "answers": sum(answers)}


def test_flood_of_commands_leaves_services_answering(cell: Ground) -> None:
    """Services are answered under the flood, and time passes."""
    found = cell.client(flood, 20_000, 10).value()
    assert found["sent"] >= 20_000
    assert found["answers"] == 10
    assert_well(cell)


BAD_COMMANDS: dict[str, tuple[dict[str, Any], str]] = {
    "not a number": ({"positions": [float("nan"), *[0.0] * 6]}, "position"),
    "infinite": ({"positions": [float("inf"), *[0.0] * 6]}, "position"),
    "unknown name": ({"names": {0: "seventh_joint"}}, "seventh_joint"),
    "no names": ({"names": None}, "joint"),
    "a name twice": ({"names": {0: "wrist_3_joint"}}, "wrist_3_joint"),
    "too short": ({"positions": [0.0] * 3}, "position"),
    "times reversed": ({"times": [2.0, 1.0]}, "time"),
    "times equal": ({"times": [1.0, 1.0]}, "time"),
}


def send_bad(cases: list[dict[str, Any]]) -> None:
    """Send bad commands one after the other, each from its own node: the cell reports a line a second for each node."""
    import os
    import sys

    import rospy
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    for number, case in enumerate(cases):
        sys.stdout.flush()
        if child := os.fork():
            assert os.waitpid(child, 0)[1] == 0
            continue
        rospy.init_node(f"clumsy_{number}")
        joints = ["elbow", "linear_arm_actuator", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3"]
        names = [f"{joint}_joint" for joint in joints]
        for index, name in (case.get("names") or {}).items():
            names[int(index)] = name
        message = JointTrajectory(joint_names=[] if "names" in case and case["names"] is None else names)
        for seconds in case.get("times", [1.0]):
            positions = case.get("positions", [2.5, 1.0, -1.2, 3.2, 3.5, -1.5, 0.0])
            message.points.append(JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(seconds)))
        publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=None)
        wait_until(publisher.get_num_connections, "connection")
        publisher.publish(message)
        rospy.signal_shutdown("all is said")
        sys.stdout.flush()
        os._exit(0)


@pytest.fixture(scope="module")
def reproofs(cell: Ground) -> dict[str, str]:
    """Reports of the cell for each bad command; none may move the arm."""

    def posture() -> list[float]:
        return list(glance(cell, "/ariac/joint_states", JointState, 26)[-1].position)

    def lines() -> list[str]:
        return [line for line in cell.log().splitlines() if "/ariac/arm/command" in line and "clumsy" in line]

    before = posture()
    cell.client(send_bad, [case for case, _ in BAD_COMMANDS.values()]).value()
    wait_until(lambda: len(lines()) == len(BAD_COMMANDS), "line about each", seen=cell.log)
    assert posture() == pytest.approx(before, abs=0.01)
    return {
        name: next(line for line in lines() if f"clumsy_{number}" in line) for number, name in enumerate(BAD_COMMANDS)
    }


@pytest.mark.parametrize("name", BAD_COMMANDS)
def test_malformed_command_is_reported_and_moves_nothing(reproofs: dict[str, str], name: str) -> None:
    _, word = BAD_COMMANDS[name]
    assert word in reproofs[name]


def bytes_that_are_no_message() -> None:
    """Publish with the right type in the header, and send something else."""
    import rospy
    from trajectory_msgs.msg import JointTrajectory

    class Garbage(JointTrajectory):  # type: ignore[misc]
        def serialize(self, buff: Any) -> None:
            buff.write(b"\xff" * 50)

    rospy.init_node("garbage", anonymous=True)
    publisher = rospy.Publisher("/ariac/arm/command", Garbage, queue_size=None)
    wait_until(publisher.get_num_connections, "connection")
    for _ in range(10):
        publisher.publish(Garbage())


def test_invalid_message_bytes_are_reported(cell: Ground) -> None:
    said = len(cell.log())
    cell.client(bytes_that_are_no_message).value()
    wait_until(lambda: "/ariac/arm/command" in cell.log()[said:], "word about it", seen=lambda: cell.log()[said:])
    assert_well(cell)


def wrong_type() -> int:
    """Return the connections of a publisher of the wrong type, once a later one of the right type has some."""
    import rospy
    from actionlib_msgs.msg import GoalID
    from std_msgs.msg import String

    rospy.init_node("wrong", anonymous=True)
    wrong = rospy.Publisher("/ariac/arm/command", String, queue_size=10)
    right = rospy.Publisher("/ariac/arm/follow_joint_trajectory/cancel", GoalID, queue_size=10)
    wait_until(right.get_num_connections, "connection")
    return int(wrong.get_num_connections())


def test_publisher_of_other_type_is_not_connected(cell: Ground) -> None:
    assert cell.client(wrong_type).value() == 0
    assert_well(cell)


def switch_gripper(count: int) -> int:
    import rospy
    from osrf_gear.srv import VacuumGripperControl

    rospy.init_node("switch", anonymous=True)
    control = rospy.ServiceProxy("/ariac/gripper/control", VacuumGripperControl)
    control.wait_for_service(TIMEOUT)
    return sum(control(index % 2 == 0).success for index in range(count))


def test_two_clients_call_service_at_once(cell: Ground) -> None:
    clients = [cell.client(switch_gripper, 200) for _ in range(2)]
    assert [client.value() for client in clients] == [200, 200]
    assert_well(cell)
