"""The example of a controller node of one's own: without ROS, and at a real roscore under the system's Python."""

import os
import runpy
import sys
import threading
import time
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.ros1.packages.contents import IO_TELEOP, write_package
from tests.examples.no_ros import install
from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

PACKAGE = Path(__file__).parents[2] / "examples" / "robot_controller"
SCRIPT = PACKAGE / "scripts" / "openloong_controller_node.py"


def joints(**positions: float) -> Any:
    return types.SimpleNamespace(name=list(positions), position=list(positions.values()))


def test_example_controller_publishes_and_moves_without_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_package(IO_TELEOP, tmp_path, tmp_path / "bin")
    graph = install(monkeypatch, tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    robot = runpy.run_path(str(SCRIPT))["OpenLoongController"]("OpenLoong/vr_configs.yml")
    try:
        states = graph.published["/io_teleop/joint_states"]
        wait_until(lambda: len(states) > 5, "joint states")
        assert len(states[0].name) == len(states[0].position) == len(states[0].velocity) == 75

        def position(name: str) -> float:
            return float(dict(zip(states[-1].name, states[-1].position, strict=True))[name])

        graph.subscribers["/io_teleop/joint_cmd"](joints(J_arm_r_04=1.2, no_such_joint=1.0))
        graph.subscribers["/openloong/look"](types.SimpleNamespace(x=0.0, y=0.2, z=-0.3))
        graph.subscribers["/io_teleop/target_gripper_status"](types.SimpleNamespace(position=[1.0, 0.0]))
        wait_until(lambda: abs(position("J_arm_r_04") - 1.2) < 0.01, "the elbow")
        wait_until(lambda: abs(position("J_head_yaw") + 0.3) < 0.01, "the look")
        wait_until(lambda: robot.grippers[0].status > 0.5 > 0.1 > robot.grippers[1].status, "the right hand")
        monkeypatch.setattr(time, "sleep", lambda _seconds: None)
        answer = graph.services["io_teleop_reset_robot"](None)
        assert (answer.success, answer.message) == (True, "Service successfully triggered!")
        monkeypatch.undo()
        wait_until(lambda: abs(position("J_arm_r_04") - 1.7) < 0.01, "home")
    finally:
        graph.is_over = True
        for thread in threading.enumerate():  # else it may be asking while the robot is closed
            if "publish_joint_states" in thread.name:
                thread.join(TIMEOUT)
        robot.close()


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    with ground(tmp_path_factory.mktemp("controller"), ros1_messages, roscore=True) as made:
        yield made


def work() -> dict[str, object]:
    import rospy
    from geometry_msgs.msg import Vector3
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("client")
    seen: dict[str, float] = {}
    rospy.Subscriber("/io_teleop/joint_states", JointState, lambda m: seen.update(zip(m.name, m.position, strict=True)))

    def out(topic: str, kind: type) -> rospy.Publisher:
        publisher = rospy.Publisher(topic, kind, queue_size=10)  # with 1, a second message may push out the first
        wait_until(publisher.get_num_connections, "connection")
        return publisher

    def wait(name: str, value: float) -> bool:
        return wait_until(lambda: abs(seen.get(name, 99.0) - value) <= 0.01, name, seen=lambda: seen.get(name))

    command, look = out("/io_teleop/joint_cmd", JointState), out("/openloong/look", Vector3)
    command.publish(JointState(name=["J_arm_l_04"], position=[1.0]))
    command.publish(JointState(name=["J_arm_l_04"], position=[float("nan")]))  # a traceback in its log, and no more
    look.publish(Vector3(0.0, 0.1, 0.4))
    moved = wait("J_arm_l_04", 1.0) and wait("J_head_yaw", 0.4)
    rospy.wait_for_service("/io_teleop_reset_robot", TIMEOUT)
    answer = rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    return {"moved": moved, "success": answer.success, "message": answer.message, "home": wait("J_arm_l_04", 1.7)}


@pytest.mark.ros1
def test_example_controller_works_at_real_roscore(ros: Ground, tmp_path: Path) -> None:
    share = tmp_path / "share"
    write_package(IO_TELEOP, share / IO_TELEOP, tmp_path / "bin")
    (share / "robot_controller").symlink_to(PACKAGE)
    packages = f"{share}:/usr/share"
    node = ros.start(["rosrun", "robot_controller", SCRIPT.name], ROS_PACKAGE_PATH=packages)
    node.wait_for("ready: 75 joints")
    listed = ros.tool("rostopic", "list").split()
    names = {"joint_cmd", "joint_states", "target_gripper_status", "target_joint_from_vr"}
    assert {f"/io_teleop/{name}" for name in names} | {"/openloong/look"} <= set(listed)
    assert ros.client(work).value() == {
        "moved": True,
        "success": True,
        "message": "Service successfully triggered!",
        "home": True,
    }
    robots = node.relatives()
    assert robots
    node.interrupt()
    wait_until(lambda: not node.relatives(), "end of the robot's process")


def test_example_controller_script_is_executable() -> None:
    assert os.access(SCRIPT, os.X_OK)
    assert SCRIPT.read_text(encoding="utf-8").startswith("#!/usr/bin/env python3\n")
