"""Operators over ROS 2: at the node of a robot of ours, and at another vendor's that knows only joints."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Any

import pytest

from cellwright.cli.operate.connection import AddressArguments, NodeConnection
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.robot import JOINT_STATES, JointLimits, OperatedRobot, ServiceCaller
from cellwright.config.robot.robots import load_robot
from tests.ros2.ground import Ground, ground
from tests.ros2.requirement import installation
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

QUICK = ("--frequency", "2", "--duration", "0.5", "--amplitude", "0.2", "--json")
PRESSES = 120
TRACK = "time,right_elbow,gripper_right,gripper_left\n0.0,1.45,1,0\n0.2,1.4,1,0\n"


@pytest.fixture(scope="module")
def tandem(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    """A robot with two arms, in a domain of its own; a test that stops it clears the stop."""
    with ground(tmp_path_factory.mktemp("operated")) as made:
        made.teleop("tandem")
        yield made


def operate(domain: Ground, *arguments: str, rules: Sequence[str] = ()) -> Process:
    """Return a finished `cellwright operate … --ros2`."""
    process = domain.cellwright("operate", *arguments, "--ros2", *rules)
    assert process.finish() == 0, process.said
    return process


def signal(domain: Ground, joint: str) -> dict[str, Any]:
    """Return the result of a test signal."""
    process = operate(domain, "signal", joint, *QUICK)
    found: dict[str, Any] = json.loads(process.out)
    return found


def minimal_node() -> None:
    """Run the simplest node: joints creep to their targets; no clock, no status, nothing else.

    It takes targets from its hundredth message on that another node may get: a client must not take it for one that
    takes none.
    """
    import rclpy
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import JointState

    rclpy.init()
    node = rclpy.create_node("minimal_node")
    position, target = [0.1, 0.2], [0.1, 0.2]
    names = ["head", "elbow"]

    def take(message: Any) -> None:
        for name, value in zip(message.name, message.position):  # noqa: B905
            target[names.index(name)] = value

    met = []
    publisher = node.create_publisher(JointState, "/io_teleop/joint_states", qos_profile_sensor_data)

    def publish() -> None:
        for number in range(2):
            position[number] += 0.25 * (target[number] - position[number])
        message = JointState(name=names, position=position)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)
        if len(node.get_node_names()) > 1:
            met.append(message)
        if len(met) == 100:
            node.create_subscription(JointState, "/io_teleop/joint_cmd", take, qos_profile_sensor_data)

    node.create_timer(0.01, publish)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        return


def test_signal_over_ros2_moves_joint_of_minimal_node(domain: Ground) -> None:
    process = domain.client(minimal_node)
    (elbow,) = signal(domain, "elbow")["joints"]
    assert elbow["start"] == pytest.approx(0.2, abs=1e-6)
    assert elbow["delay"] > 0.01  # a quarter of the way every 10 ms, and the way through ROS
    assert elbow["state_rate"] > 0.0
    assert process.running
    process.interrupt()


def test_motion_over_ros2_is_played_within_published_limits(tandem: Ground) -> None:
    where = tandem.folder / "cell"
    (where / "grip.csv").write_text(TRACK)
    played = operate(tandem, "play", "grip.csv")
    assert played.out.startswith("done: "), played.said
    assert played.err == ""


def test_signal_over_ros2_moves_joint_of_robot_in_namespace(domain: Ground) -> None:
    rules = ("--ros-args", "-r", "__ns:=/robot1", "-r", "io_teleop/joint_cmd:=/targets", "-p", "qos./a.depth:=1")
    domain.teleop("tandem", *rules)
    process = operate(domain, "signal", "right_elbow", *QUICK, rules=rules)
    (elbow,) = json.loads(process.out)["joints"]
    assert elbow["delay"] > 0.0  # null where the joint does not follow
    assert "limit 2.5" in process.err  # a warning, which comes from the description
    assert operate(domain, "call", "home", rules=rules).out.startswith("home")
    outside = domain.cellwright("operate", "call", "home", "--ros2")
    assert outside.finish() == 2
    assert "no simulator in this domain of ROS 2: /io_teleop/joint_states has no publisher" in outside.err


def test_keyboard_over_ros2_drives_robot_and_stops_it_on_way_home(
    tandem: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = installation()
    assert found is not None

    def session(node: str) -> NodeClient:
        environment = {**found.environment, **tandem.ros}
        return NodeClient(Ros2Transport(found.python, node=node, environment=environment, sign=JOINT_STATES))

    robot = OperatedRobot(session("/operator"))
    operator = Keyboard(robot, Jog(robot, JointLimits()), ServiceCaller(lambda: session("/operator_services")))
    with closing(robot.session), closing(operator.services):
        assert len(robot.tips) == len(robot.grippers) == 2
        for name, value in tandem.ros.items():
            monkeypatch.setenv(name, value)
        limits = NodeConnection(AddressArguments(ros2=True)).limits(robot)
        assert limits.source == "robot_description"
        assert limits.joints == JointLimits.of(load_robot("tandem", print).robot).joints
        start, wait = robot.tips[0].position, robot.session.wait_until
        assert operator.take("++")

        def press_until(key: str, condition: Callable[[], bool]) -> None:
            for _ in range(PRESSES):  # on a busy machine a best-effort message gets lost, and a person presses again
                operator.jog.forget()  # lost steps would pile up, until a tip that stands counts as blocked
                assert operator.take(key)
                if wait(condition, TIMEOUT / PRESSES):
                    return
            raise AssertionError(f"{key}: nothing has moved; {operator.message}")

        press_until("z", lambda: robot.tips[0].position[2] - start[2] > 0.015)
        press_until("c", lambda: robot.grippers[0] > 0.9)
        assert operator.take("/" + robot.joints[0] + "\r" + "\x1b[C\x1b[C")
        assert operator.take("H")
        assert wait(lambda: robot.status.resetting, TIMEOUT)
        assert operator.take(" ")
        assert wait(lambda: robot.status.emergency_stop, TIMEOUT)
        assert wait(lambda: operator.take("") and operator.message.startswith("home: "), TIMEOUT)
        assert "refused" in operator.message
        assert operator.take("u")
        assert wait(lambda: not robot.status.emergency_stop, TIMEOUT)
