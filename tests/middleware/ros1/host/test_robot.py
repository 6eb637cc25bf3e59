"""A robot's node at a real master: the time and the description that programs get."""

from __future__ import annotations

from typing import Any

import pytest

from cellwright.middleware.ros1.host import Ros1
from cellwright.robot.interface import robot_identity
from cellwright.util.errors import UsageError
from tests.ros1.ground import Ground

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


def joined(ground: Ground, node: str, urdf: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Set the parameters of a node, as its start does, without a bridge."""

    def fail(*_: Any, **__: Any) -> None:
        raise OSError(11, "no process left")

    with (
        monkeypatch.context() as patched,
        Ros1(print, environment=ground.environment, identity=robot_identity(node)) as ros,
    ):
        patched.setattr("cellwright.middleware.ros1.host.ros1.BridgeProcess", fail)
        ros.prepare()
        with pytest.raises(UsageError, match="no process left"):
            ros.join(("127.0.0.1", 9), {node: {"robot_description": urdf}}, lambda _seconds: None)


def test_robot_with_wall_time_leaves_use_sim_time_and_warns(master: Ground) -> None:
    said: list[str] = []
    with Ros1(said.append, environment=master.environment, identity=robot_identity("arm")) as ros:
        ros.prepare()
        assert not master.ask("hasParam", "/use_sim_time")
        assert said == []
        master.ask("setParam", "/use_sim_time", True)
        ros.prepare()
    assert master.ask("getParam", "/use_sim_time") is True
    assert "time stands still" in said[0]
    assert "rosparam set /use_sim_time false" in said[0]


def test_robot_with_sim_time_sets_use_sim_time(master: Ground) -> None:
    with Ros1(print, environment=master.environment, identity=robot_identity("arm", sim_time=True)) as ros:
        ros.prepare()
    assert master.ask("getParam", "/use_sim_time") is True


def test_robot_description_is_global_unless_set_by_other_program(
    master: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    joined(master, "arm", "first", monkeypatch)
    assert master.ask("getParam", "/robot_description") == master.ask("getParam", "/arm/robot_description") == "first"
    joined(master, "arm", "second", monkeypatch)
    assert master.ask("getParam", "/robot_description") == "second", "what an earlier run has left gives way"
    joined(master, "leg", "third", monkeypatch)
    assert master.ask("getParam", "/leg/robot_description") == "third"
    assert master.ask("getParam", "/robot_description") == "second", "it is of another node"


def test_other_robot_at_same_master_is_reported(master: Ground) -> None:
    program = """
import rospy
from sensor_msgs.msg import JointState
rospy.init_node("other_robot")
states = rospy.Publisher("/io_teleop/joint_states", JointState, queue_size=1)
print("there", flush=True)
rospy.spin()
"""
    master.client(program).wait_for("there")
    said: list[str] = []
    with Ros1(said.append, environment=master.environment, identity=robot_identity("arm")) as ros:
        ros.prepare()
    (line,) = said
    assert line.startswith("/other_robot also publishes /io_teleop/joint_states at http://")


def test_robot_with_name_of_running_node_is_refused(master: Ground) -> None:
    other = master.client("import rospy; rospy.init_node('arm'); print('there', flush=True); rospy.spin()")
    other.wait_for("there")
    with (
        Ros1(print, environment=master.environment, identity=robot_identity("arm")) as ros,
        pytest.raises(UsageError, match=r"node /arm already runs at .*; stop it, or choose another name"),
    ):
        ros.prepare()
    assert other.running
