"""Errors of programs with a robot's node: it reports each in a line, keeps its pace, and the robot does not move."""

from __future__ import annotations

import random
import socket
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

NODE = "/sim_robot_controller_node"
HOME = 1.7
"""Home position of the observed joint, J_arm_r_04 [rad]."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """A robot for all bad programs, one after the other; it must work to the end."""
    with ground(tmp_path_factory.mktemp("faults"), ros1_messages) as made:
        made.teleop("qinglong")
        yield made


def look(to: float) -> dict[str, Any]:
    """Command a joint; return its position before, and the joint states until it arrived."""
    import rospy
    from sensor_msgs.msg import JointState

    joint = "J_arm_r_04"
    rospy.init_node("look", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=10)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append, tcp_nodelay=True)
    wait_until(lambda: states and commands.get_num_connections(), "connections")
    place = states[-1].name.index(joint)
    before = states[-1].position[place]
    commands.publish(JointState(name=[joint], position=[to]))
    wait_until(lambda: abs(states[-1].position[place] - to) < 0.01, "arrival", seen=lambda: states[-1])
    return {"before": before, "numbers": [state.header.seq for state in states]}


def assert_well(robot: Ground, *, at: float) -> None:
    """Check that it has not moved, takes a command, misses no joint state, and has printed only a few lines."""
    found = robot.client(look, at + 0.1).value()
    assert found["before"] == pytest.approx(at, abs=0.01)
    begin = found["numbers"][0]
    assert found["numbers"] == list(range(begin, begin + len(found["numbers"])))
    assert "Traceback" not in robot.log()
    assert len(robot.log().splitlines()) < 300


def misbehave(count: int) -> int:
    """Send invalid messages; return their number."""
    import struct
    import time

    import rospy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    class Garbage(JointState):  # type: ignore[misc]
        def serialize(self, buff: Any) -> None:
            buff.write(self.bytes)

    rospy.init_node("clumsy", anonymous=True)
    topics = ["joint_cmd", "target_joint_from_vr", "target_gripper_status"]
    wrong_type = rospy.Publisher("/io_teleop/target_finger_joints", String, queue_size=10)
    commands = [rospy.Publisher(f"/io_teleop/{name}", Garbage, queue_size=None) for name in topics]
    wait_until(lambda: all(each.get_num_connections() for each in commands), "connections")

    def of(names: list[str], positions: list[float]) -> bytes:
        data = struct.pack("<IIII", 0, 0, 0, 0) + struct.pack("<I", len(names))
        data += b"".join(struct.pack("<I", len(name)) + name.encode() for name in names)
        return data + struct.pack(f"<I{len(positions)}dII", len(positions), *positions, 0, 0)

    nan, inf = float("nan"), float("inf")
    bad = [
        of(["J_arm_r_04"], [nan]),
        of(["J_arm_r_04"], [inf]),
        of(["J_arm_r_04", "J_arm_r_03"], [0.5]),
        of(["J_arm_r_04"], [0.5, 0.5, nan]),
        of([], [nan, 1.0, 2.0]),
        of(["no_such_joint"], [1.0]),
        of(["", "\0", "J_arm_r_04\n"], [1.0, 1.0, 1.0]),
        of([f"joint{number}" for number in range(2000)], [0.0] * 2000),
        of(["J_arm_r_04"], [0.5])[:-9],
        of(["J_arm_r_04"], [0.5]) + b"more",
        b"",
        b"\xff" * 50,
        struct.pack("<IIII", 0, 0, 0, 0) + b"\xff\xff\xff\xff",
        struct.pack("<IIIII", 0, 0, 0, 0, 1) + b"\x02\0\0\0\xc3\x28" + struct.pack("<IdII", 1, 0.5, 0, 0),
    ]
    message = Garbage()
    for number in range(count):
        message.bytes = bad[number % len(bad)]
        commands[number // len(bad) % 2].publish(message)
        if number % 25 == 0:
            time.sleep(0.02)  # noqa: TID251 - no condition: of what comes faster more would be dropped unseen
    message.bytes = of(["a"] * 300_000, [1.0] * 300_000)
    for publisher in commands:
        publisher.publish(message)
    assert wrong_type.get_num_connections() == 0
    return count


def test_thousand_malformed_messages_move_nothing(robot: Ground) -> None:
    assert robot.client(misbehave, 1000).value() == 1000
    for word in ("/io_teleop/joint_cmd", "clumsy"):
        wait_until(lambda word=word: word in robot.log(), f"word of {word}")  # type: ignore[misc]
    assert_well(robot, at=HOME)


def test_foreign_bytes_at_ports_leave_robot_running(robot: Ground) -> None:
    """At the port of its topics and services, and at that of its slave API."""
    chance = random.Random(0)
    uri = robot.ask("lookupNode", NODE)
    with xmlrpc.client.ServerProxy(uri) as slave:
        said = cast("Any", slave.requestTopic("/test", "/io_teleop/joint_states", [["TCPROS"]]))
        _, host, port = said[2]
        wrong: tuple[tuple[Any, ...], ...] = ((), ("/t", 5, [["TCPROS"]]), ("/t", "/x", "TCPROS"), (None, {}, []))
        for nonsense in wrong:
            try:
                assert cast("Any", slave.requestTopic(*nonsense))[0] != 1
            except (xmlrpc.client.Error, TypeError):
                continue
    for place in ((host, port), ("127.0.0.1", int(uri.rstrip("/").rpartition(":")[2]))):
        for number in range(50):
            with socket.create_connection(place, TIMEOUT) as connection:
                connection.sendall(chance.randbytes(chance.choice((1, 4, 200, 5000))))
                if number % 2:
                    connection.shutdown(socket.SHUT_WR)
    assert_well(robot, at=HOME + 0.1)


def flood(count: int) -> dict[str, Any]:
    """Command a joint at full speed to changing targets; return its position once it has reached the last."""
    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("flood", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=None, tcp_nodelay=True)
    states: list[Any] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, states.append)
    wait_until(lambda: states and commands.get_num_connections(), "connections")
    place = states[-1].name.index("J_arm_r_04")
    message = JointState(name=["J_arm_r_04"], position=[0.0])
    sent, before = 0, len(states)
    while sent < count or len(states) < before + 100:
        message.position = [1.5 + sent % 100 / 100]
        commands.publish(message)
        sent += 1
    message.position = [1.3]
    commands.publish(message)
    wait_until(lambda: abs(states[-1].position[place] - 1.3) < 0.02, "arrival", seen=lambda: states[-1])
    return {"sent": sent, "numbers": [state.header.seq for state in states]}


def test_flood_of_commands_keeps_joint_states_and_last_command(robot: Ground) -> None:
    """Joint states go on during the flood, and the last command counts."""
    found = robot.client(flood, 20_000).value()
    assert found["sent"] >= 20_000
    begin = found["numbers"][0]
    assert found["numbers"] == list(range(begin, begin + len(found["numbers"])))
    assert_well(robot, at=1.3)
