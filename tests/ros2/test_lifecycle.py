"""Life of the bridge: late and other subscribers, parameters, restarts, namespaces, domains and clean ends."""

import os
import signal
from pathlib import Path
from typing import Any

import pytest

from tests.ros2.ground import Ground, bridge_pid, ground
from tests.support.processes import is_running
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2


def start_and_listen() -> dict[str, Any]:
    """Start the competition; listen to orders and joint states as different programs do."""
    from rclpy.qos import QoSProfile
    from rclpy_node import BEST_EFFORT, LATCHED, Node

    with Node() as me:
        started = me.call("/ariac/start_competition", "std_srvs/Trigger")
        early = me.listen("/ariac/orders", "osrf_gear/Order", LATCHED)
        me.wait(lambda: early, "order")
        late = me.listen("/ariac/orders", "osrf_gear/Order", LATCHED)
        volatile = me.listen("/ariac/orders", "osrf_gear/Order", QoSProfile(depth=1))
        reliable = me.listen("/ariac/joint_states", "sensor_msgs/JointState", 10)
        best_effort = me.listen("/ariac/joint_states", "sensor_msgs/JointState", BEST_EFFORT)
        frames = me.listen("/tf_static", "tf2_msgs/TFMessage", LATCHED)
        described = me.listen("/robot_description", "std_msgs/String", LATCHED)
        me.wait(lambda: len(reliable) > 20 and len(best_effort) > 20 and late and frames and described, "messages")
        return {
            "started": started.success,
            "orders": [len(early), len(late), len(volatile)],
            "frames": [each.child_frame_id for each in frames[0].transforms],
            "description": described[0].data[:200],
        }


def test_subscribers_of_every_kind_get_messages_and_late_ones_the_order_once(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    found = domain.client(start_and_listen).value()
    assert found["started"]
    assert found["orders"] == [1, 1, 0]
    assert "bin1_frame" in found["frames"]
    assert "<robot" in found["description"]


def set_parameters() -> dict[str, Any]:
    """Read and set parameters of the cell's node."""
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rclpy_node import Node

    def value(number: float) -> Any:
        return ParameterValue(type=3, double_value=number)

    with Node() as me:

        def call(service: str, kind: str, **fields: Any) -> Any:
            return me.call(f"/cellwright/{service}", f"rcl_interfaces/{kind}", **fields)

        names = call("list_parameters", "ListParameters").result.names
        fast = call("set_parameters", "SetParameters", parameters=[Parameter(name="speed", value=value(4.0))])
        read_only = Parameter(name="robot_description", value=ParameterValue(type=4, string_value="x"))
        refused = call("set_parameters", "SetParameters", parameters=[read_only])
        negative = call("set_parameters", "SetParameters", parameters=[Parameter(name="speed", value=value(-1.0))])
        unlimited = call("set_parameters", "SetParameters", parameters=[Parameter(name="speed", value=value(0.0))])
        speed = call("get_parameters", "GetParameters", names=["speed"]).values[0].double_value
        return {
            "names": list(names),
            "set": [each.results[0].successful for each in (fast, refused, negative, unlimited)],
            "speed": speed,
        }


def test_speed_is_settable_and_description_read_only(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    found = domain.client(set_parameters).value()
    assert {"robot_description", "speed"} <= set(found["names"])
    assert found["set"] == [True, False, False, True]
    assert found["speed"] == 0.0


def test_speed_is_no_parameter_in_competition(domain: Ground) -> None:
    domain.serve("lesson")
    found = domain.client(set_parameters_of_competition).value()
    assert "speed" not in found


def set_parameters_of_competition() -> list[str]:
    from rclpy_node import Node

    with Node() as me:
        return list(me.call("/cellwright/list_parameters", "rcl_interfaces/ListParameters").result.names)


def wait_for_clock() -> int:
    """Return the time of the first message on /clock [ns]."""
    from rclpy_node import Node

    with Node() as me:
        clock = me.listen("/clock", "rosgraph_msgs/Clock")
        me.wait(lambda: clock, "clock")
        return int(clock[0].clock.sec * 10**9 + clock[0].clock.nanosec)


def test_killed_bridge_comes_back(domain: Ground) -> None:
    cell = domain.serve("lesson", "-d")
    first = bridge_pid(cell)
    os.kill(first, signal.SIGKILL)
    cell.wait_for("the ROS 2 bridge was ended by SIGKILL; restarting it")
    cell.wait_for("all topics and services are in ROS 2 again")
    assert bridge_pid(cell) != first
    assert domain.client(wait_for_clock).value() > 0


def test_client_that_was_killed_is_replaced_by_next(domain: Ground) -> None:
    domain.serve("lesson", "-d")
    client = domain.client(listen_forever)
    client.wait_for("listening")
    client.kill()
    assert domain.client(start_and_listen).value()["started"]


def listen_forever() -> None:
    from rclpy_node import Node

    with Node() as me:
        found = me.listen("/ariac/joint_states", "sensor_msgs/JointState")
        me.wait(lambda: found, "message")
        print("listening", flush=True)
        me.wait(lambda: False, "end")


def start_first_of_two_cells() -> dict[str, Any]:
    """Start the competition of one of two cells; return the names of topics, and the states of both competitions."""
    from rclpy_node import Node

    with Node() as me:
        clocks = [me.listen(f"/cell{number}/clock", "rosgraph_msgs/Clock") for number in (1, 2)]
        states = [me.listen(f"/cell{number}/ariac/competition_state", "std_msgs/String") for number in (1, 2)]
        me.wait(lambda: all(clocks), "clocks")
        started = me.call("/cell1/ariac/start_competition", "std_srvs/Trigger")
        me.wait(lambda: states[0] and states[0][-1].data == "go", "start")
        seen = len(states[1])
        me.wait(lambda: len(states[1]) > seen + 2, "state of the other")
        names = [name for name, _ in me.node.get_topic_names_and_types()]
        return {"started": started.success, "states": [each[-1].data for each in states], "names": names}


def topics_of_cell() -> list[str]:
    from rclpy_node import Node

    with Node() as me:
        me.wait(lambda: me.node.count_publishers("/clock"), "clock")
        return [name for name, _ in me.node.get_topic_names_and_types()]


def test_cells_of_two_domains_and_namespaces_are_apart(domain: Ground, tmp_path: Path) -> None:
    with ground(tmp_path / "other") as other:
        domain.serve("lesson", "-d", "--ros-args", "-r", "__ns:=/cell1", "-r", "ariac/orders:=/orders")
        domain.serve("lesson", "-d", "--ros-args", "-r", "__ns:=/cell2")
        other.serve("lesson", "-d")
        here, there = domain.client(start_first_of_two_cells).value(), other.client(topics_of_cell).value()
    assert here["started"]
    assert here["states"] == ["go", "init"]
    assert {"/cell1/ariac/joint_states", "/cell2/ariac/joint_states", "/orders"} <= set(here["names"])
    assert not any(name.startswith(("/ariac", "/clock", "/tf")) for name in here["names"])
    assert "/ariac/joint_states" in there
    assert not any(name.startswith("/cell") and not name.startswith("/cellwright") for name in there)


def names_of_topics() -> list[str]:
    from rclpy_node import Node

    with Node() as me:
        me.wait(lambda: "cellwright" in me.node.get_node_names(), "node")
        return [name for name, _ in me.node.get_topic_names_and_types()]


def test_cell_has_names_of_choice(domain: Ground, tmp_path: Path) -> None:
    with ground(tmp_path / "other") as other:
        domain.serve("lesson", "--ros2-names", "2017")
        other.serve("lesson", "--ros2-names", "ros2_control")
        old, new = (set(each.client(names_of_topics).value()) for each in (domain, other))
    names = {"/joint_states", "/arm_controller/joint_trajectory", "/arm_controller/controller_state"}
    assert not old & names
    assert names <= new
    assert {"/ariac/joint_states", "/ariac/arm/command"} <= old
    assert not {"/ariac/joint_states", "/ariac/arm/command"} & new
    assert "/ariac/orders" in old & new


def hear_recording() -> list[float]:
    """Return positions of the rail, as a recording has them."""
    from rclpy_node import Node

    with Node() as me:
        states = me.listen("/joint_states", "sensor_msgs/JointState")
        me.wait(lambda: len(states) > 5, "states")
        return [each.position[list(each.name).index("linear_arm_actuator_joint")] for each in states]


@pytest.mark.slow
def test_recording_is_played_to_programs(domain: Ground) -> None:
    made = domain.cellwright(
        "run", "lesson", "--agent", "lesson", "--until", "3", "--no-picture", "--record", "run.mcap"
    )
    made.finish()
    domain.ready("replay", "run.mcap", "--loop")
    assert len(domain.client(hear_recording).value()) > 5


def publish_another_type() -> None:
    from rclpy_node import Node, interface

    with Node("stranger") as me:
        publisher = me.node.create_publisher(interface("std_msgs/String"), "/ariac/arm/command", 10)
        me.wait(lambda: me.node.count_subscribers("/ariac/arm/command"), "cell")
        print("there", flush=True)
        me.wait(lambda: publisher is None, "end")


def test_type_that_other_node_defines_otherwise_is_reported(domain: Ground) -> None:
    cell = domain.serve("lesson", "-d")
    client = domain.client(publish_another_type)
    cell.wait_for("/ariac/arm/command: /stranger has std_msgs/msg/String, not trajectory_msgs/msg/JointTrajectory")
    client.kill()


def publish_best_effort() -> None:
    from rclpy_node import BEST_EFFORT, Node, interface

    with Node("careless") as me:
        kind = interface("trajectory_msgs/JointTrajectory")
        publisher = me.node.create_publisher(kind, "/ariac/arm/command", BEST_EFFORT)
        me.wait(lambda: publisher is None, "end")


def test_publisher_whose_quality_of_service_does_not_fit_is_reported(domain: Ground) -> None:
    cell = domain.serve("lesson", "-d")
    client = domain.client(publish_best_effort)
    cell.wait_for("ariac/arm/command', offering incompatible QoS", 30.0)
    client.kill()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_cell_ends_cleanly(domain: Ground, number: signal.Signals) -> None:
    """A bench ends it twenty times."""
    cell = domain.serve("lesson", "-d")
    client = domain.client(start_and_listen)
    client.value()
    bridge = bridge_pid(cell)
    cell.signal(number)
    assert cell.finish() == 0
    wait_until(lambda: not is_running(bridge), "end of the bridge")
    assert "ROS 2:" not in cell.said
    assert "Traceback" not in cell.said


def test_missing_interface_and_unknown_range_are_refused(domain: Ground) -> None:
    for arguments, reason in (
        (("serve", "lesson", "--ros2", "--ros2-range", "far"), "--ros2-range far: give localhost or subnet"),
        (("serve", "lesson", "--ros2", "--ros2-names", "all"), "--ros2-names all: give both, 2017 or ros2_control"),
        (("serve", "lesson", "--ros2-range", "subnet"), "--ros2-range requires --ros2"),
        (("serve", "lesson", "--ros-args", "-r", "__ns:=/a"), "--ros-args requires --ros2"),
        (
            ("serve", "lesson", "--ros2", "--ros-args", "-r", "__node:=a/b"),
            "Couldn't parse remap rule: '-r __node:=a/b'",
        ),
    ):
        process = domain.cellwright(*arguments)
        assert process.finish() == 2
        assert reason in process.err
        assert process.said.count(reason) == 1
        assert "/src/" not in process.err
    process = domain.cellwright("serve", "lesson", "--ros2", CELLWRIGHT_ROS2_PYTHON="/usr/bin/python3")
    assert process.finish() == 2
    assert "has no rclpy" in process.err
