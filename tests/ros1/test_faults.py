"""What clients do wrong: the cell says so in a line, keeps its pace, and serves the next one."""

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground, ground
from tests.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """A cell that all the bad clients come to, one after the other; it has to be well to the end."""
    with ground(tmp_path_factory.mktemp("faults"), ros1_messages) as made:
        made.serve("lesson", "-d")
        yield made


def keeps_pace() -> float:
    """Simulated seconds a second of the wall, over two of them."""
    import time

    import rospy

    rospy.init_node("watch", anonymous=True)
    while rospy.get_time() == 0.0:
        time.sleep(0.01)
    begin, simulated = time.monotonic(), rospy.get_time()
    time.sleep(2.0)
    return float(rospy.get_time() - simulated) / (time.monotonic() - begin)


def assert_well(cell: Ground) -> None:
    """It answers, and time passes as on the wall."""
    assert "success: True" in cell.tool("rosservice", "call", "/ariac/gripper/control", "false")
    assert cell.client(keeps_pace).value() == pytest.approx(1.0, abs=0.05)


def call_and_die(service: str, count: int) -> None:
    """Ask for something, and be gone before the answer."""
    import os
    import signal
    import threading

    import rospy
    import rosservice

    rospy.init_node("short_lived", anonymous=True)
    rospy.wait_for_service(service, 10.0)
    kind = rosservice.get_service_class_by_name(service)
    proxies = [rospy.ServiceProxy(service, kind) for _ in range(count)]
    for proxy in proxies:
        threading.Thread(target=proxy, daemon=True).start()
    threading.Event().wait(random_moment := int.from_bytes(os.urandom(1), "big") / 50_000)
    print("gone after", random_moment, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_client_killed_in_mid_service(cell: Ground) -> None:
    clients = [cell.client(call_and_die, "/ariac/material_locations", 20) for _ in range(3)]
    for client in clients:
        assert client.finish() == -signal.SIGKILL
        assert "gone after" in client.out
    assert_well(cell)


def flood(rate: float, seconds: float) -> dict[str, float]:
    """Send commands at a rate [1/s of wall time], and ask services all the while."""
    import threading
    import time

    import rospy
    from osrf_gear.srv import VacuumGripperControl
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rospy.init_node("flood", anonymous=True)
    publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=None, tcp_nodelay=True)
    while publisher.get_num_connections() == 0:
        time.sleep(0.01)
    names = ["elbow", "linear_arm_actuator", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3"]
    message = JointTrajectory(joint_names=[f"{name}_joint" for name in names])
    positions = [1.51, 0.0, -1.13, 3.14, 3.77, -1.51, 0.0]
    message.points = [JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(1.0))]
    stop, waits = threading.Event(), []

    def ask() -> None:
        control = rospy.ServiceProxy("/ariac/gripper/control", VacuumGripperControl, persistent=True)
        while not stop.wait(0.1):
            begin = time.monotonic()
            control(False)
            waits.append(time.monotonic() - begin)

    asking = threading.Thread(target=ask)
    asking.start()
    begin, sent, simulated = time.monotonic(), 0, rospy.get_time()
    while (passed := time.monotonic() - begin) < seconds:
        while sent < passed * rate:
            publisher.publish(message)
            sent += 1
        time.sleep(0.001)
    factor = (rospy.get_time() - simulated) / passed
    stop.set()
    asking.join()
    return {"sent": sent, "rate": sent / passed, "factor": factor, "wait": max(waits), "waits": len(waits)}


def test_ten_thousand_commands_a_second(cell: Ground) -> None:
    found = cell.client(flood, 10_000, 4.0).value()
    assert found["rate"] > 5_000  # how fast a client gets rid of them depends on the machine
    assert found["waits"] >= 10
    assert found["wait"] < 1.0
    assert found["factor"] == pytest.approx(1.0, abs=0.1)
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


def send_bad(case: dict[str, Any]) -> None:
    import rospy
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rospy.init_node("clumsy", anonymous=True)
    joints = ["elbow", "linear_arm_actuator", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3"]
    names = [f"{joint}_joint" for joint in joints]
    for index, name in (case.get("names") or {}).items():
        names[int(index)] = name
    message = JointTrajectory(joint_names=[] if "names" in case and case["names"] is None else names)
    for seconds in case.get("times", [1.0]):
        positions = case.get("positions", [2.5, 1.0, -1.2, 3.2, 3.5, -1.5, 0.0])
        message.points.append(JointTrajectoryPoint(positions=positions, time_from_start=rospy.Duration(seconds)))
    publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=10)
    while publisher.get_num_connections() == 0:
        rospy.sleep(0.01)
    publisher.publish(message)
    rospy.sleep(0.3)


def posture() -> list[float]:
    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("look", anonymous=True)
    return list(rospy.wait_for_message("/ariac/joint_states", JointState, 10.0).position)


@pytest.mark.parametrize("name", BAD_COMMANDS)
def test_a_malformed_command_is_told_and_moves_nothing(cell: Ground, name: str) -> None:
    case, word = BAD_COMMANDS[name]
    before, said = cell.client(posture).value(), len(cell.log())
    cell.client(send_bad, case).value()
    wait_until(lambda: "/ariac/arm/command" in cell.log()[said:], "line about it", seen=lambda: cell.log()[said:])
    assert word in cell.log()[said:]
    assert "clumsy" in cell.log()[said:], "whose command it was"
    assert cell.client(posture).value() == pytest.approx(before, abs=0.01)


def bytes_that_are_no_message() -> None:
    """A publisher that says the right type and sends something else."""
    import rospy
    from trajectory_msgs.msg import JointTrajectory

    class Garbage(JointTrajectory):  # type: ignore[misc]
        def serialize(self, buff: Any) -> None:
            buff.write(b"\xff" * 50)

    rospy.init_node("garbage", anonymous=True)
    publisher = rospy.Publisher("/ariac/arm/command", Garbage, queue_size=10)
    while publisher.get_num_connections() == 0:
        rospy.sleep(0.01)
    for _ in range(10):
        publisher.publish(Garbage())
        rospy.sleep(0.05)


def test_bytes_that_are_no_message(cell: Ground) -> None:
    said = len(cell.log())
    cell.client(bytes_that_are_no_message).value()
    wait_until(lambda: "/ariac/arm/command" in cell.log()[said:], "word about it")
    assert_well(cell)


def wrong_type() -> int:
    import rospy
    from std_msgs.msg import String

    rospy.init_node("wrong", anonymous=True)
    publisher = rospy.Publisher("/ariac/arm/command", String, queue_size=10)
    rospy.sleep(1.0)
    return int(publisher.get_num_connections())


def test_a_publisher_of_another_type_is_not_listened_to(cell: Ground) -> None:
    assert cell.client(wrong_type).value() == 0
    assert_well(cell)


def switch_gripper(count: int) -> int:
    import rospy
    from osrf_gear.srv import VacuumGripperControl

    rospy.init_node("switch", anonymous=True)
    control = rospy.ServiceProxy("/ariac/gripper/control", VacuumGripperControl)
    control.wait_for_service(10.0)
    return sum(control(index % 2 == 0).success for index in range(count))


def test_two_clients_at_once(cell: Ground) -> None:
    clients = [cell.client(switch_gripper, 200) for _ in range(2)]
    assert [client.value() for client in clients] == [200, 200]
    assert_well(cell)
