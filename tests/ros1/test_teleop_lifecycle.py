"""A robot's node that is stopped, killed, or loses its master: it ends and recovers completely."""

from __future__ import annotations

import re
import signal

import pytest

from cellwright.middleware.messages.standard import Clock, JointState
from tests.ros1.glance import glance
from tests.ros1.ground import Ground
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

NODE = "/sim_robot_controller_node"
TIMESTEP = 1e9 / 240
"""Time step of the simulation [ns]: a message comes with the step next to its time."""


def send_off() -> None:
    """Send an arm far away, and keep running; report its motion."""
    import rospy
    from sensor_msgs.msg import JointState

    rospy.init_node("pilot", anonymous=True)
    commands = rospy.Publisher("/io_teleop/joint_cmd", JointState, queue_size=10)
    velocities: list[float] = []
    rospy.Subscriber("/io_teleop/joint_states", JointState, lambda message: velocities.append(max(message.velocity)))
    wait_until(lambda: velocities and commands.get_num_connections(), "connections")
    commands.publish(JointState(name=["J_arm_r_01"], position=[2.9]))
    wait_until(lambda: max(velocities) >= 1.0, "motion", seen=lambda: velocities[-1])
    print("it moves", flush=True)
    rospy.spin()


def moving(ground: Ground, *options: str) -> Process:
    """Start a robot in motion, with a program that commands it."""
    robot = ground.teleop("qinglong", *options)
    ground.client(send_off).wait_for("it moves")
    return robot


def registered(ground: Ground) -> set[str]:
    """Return the registrations of the node at the master."""
    return {name for role in ground.ask("getSystemState") for name, nodes in role if NODE in nodes}


def test_ctrl_c_during_motion_ends_robot_and_unregisters(master: Ground) -> None:
    robot = moving(master)
    assert robot.interrupt() == 0
    assert robot.relatives() == []
    assert registered(master) == set()
    assert "Traceback" not in robot.said
    assert re.search(r"^commands +1 taken", robot.out, re.MULTILINE)


def test_robot_killed_during_motion_leaves_no_process(no_master: Ground) -> None:
    """Its own roscore ends too. Until then it has published the time, and its state every 10 ms of it."""
    robot = moving(no_master, "--sim-time")
    assert no_master.ask("getParam", "/use_sim_time") is True
    (now,) = glance(no_master, "/clock", Clock, node=NODE)
    states = glance(no_master, "/io_teleop/joint_states", JointState, 20, node=NODE)
    stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in states]
    assert stamps[-1] - stamps[0] == pytest.approx(0.19e9, abs=TIMESTEP)
    assert 0 < now.clock.sec * 10**9 + now.clock.nanosec <= stamps[-1] < 10**12, (
        "since the node's start, not since 1970"
    )
    robot.signal(signal.SIGKILL)
    robot.finish()
    wait_until(
        lambda: not robot.relatives(), "end of all processes", seen=lambda: [name_of(pid) for pid in robot.relatives()]
    )
    with pytest.raises(OSError):  # noqa: PT011 - whatever it is, nobody answers
        no_master.ask("getPid")


def test_robot_registers_again_at_restarted_master(master: Ground) -> None:
    robot = master.teleop("qinglong", "--node", "openloong_controller_node")
    second = master.cellwright("teleop", "qinglong", "--ros1", "--port", "0", "--node", "openloong_controller_node")
    assert second.finish() == 2
    assert "node /openloong_controller_node already runs" in second.err
    master.stop_master()
    robot.wait_for("the ROS master at .* is gone")
    master.start_master()
    robot.wait_for("all topics and services are in ROS 1 again")
    assert "/openloong_controller_node" in master.tool("rosnode", "list").split()
    assert '<robot name="QingLong">' in master.ask("getParam", "/robot_description")
    assert not master.ask("hasParam", "/use_sim_time")
    said = master.tool("rostopic", "echo", "-n", "1", "/io_teleop/joint_states/name")
    assert "J_head_yaw" in said
