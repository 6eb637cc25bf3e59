"""Overload: on a busy machine the cell's clock waits, and nothing is lost."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from cellwright.cli.serve import RESULT
from cellwright.clients.client.socket_transport import SocketTransport
from tests.ros1.ground import Ground
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = [pytest.mark.ros1, pytest.mark.slow]


NICE = 19
"""Niceness of the bridge beside the busy processes. If time did not stand, commands would be missed then."""


@contextmanager
def stopped(pid: int) -> Iterator[None]:
    """Stop a process within a block."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def bridge_of(cell: Process) -> int:
    """Return the process of a cell's bridge."""
    (bridge,) = [pid for pid in cell.relatives() if "ros1/bridge" in name_of(pid)]
    return bridge


def passes(observer: SocketTransport) -> bool:
    """Return whether time passes during many requests, of which a tick answers several."""
    observer.ask_server(RESULT)
    before = observer.now()
    for _ in range(100):
        observer.ask_server(RESULT)
    return observer.now() > before


def test_time_stands_while_bridge_is_stopped(master: Ground) -> None:
    cell = master.serve("lesson")
    host, port = cell.wait_for(r"^ready: lesson at (\S+):(\d+)").groups()
    bridge = bridge_of(cell)
    observer = SocketTransport((host, int(port)), node="/onlooker")
    try:
        with stopped(bridge):
            cell.wait_for("time stands while the bridge to ROS 1, or a subscriber there, is more than 0.1 s behind")
            # The line comes once: a busy machine may have been late before.
            wait_until(lambda: not passes(observer), "time that stands")
        wait_until(lambda: passes(observer), "time that passes")
    finally:
        observer.close()
    assert "dropped" not in cell.said


def program(count: int) -> dict[str, Any]:
    """Send the rail back and forth, and record every joint state."""
    import rospy
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    names = [
        "linear_arm_actuator_joint", "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
        "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
    ]  # fmt: skip
    rospy.init_node("team")
    states: list[Any] = []
    rospy.Subscriber("/ariac/joint_states", JointState, states.append)
    publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=10)
    start = rospy.ServiceProxy("/ariac/start_competition", Trigger)
    start.wait_for_service()
    wait_until(lambda: states and publisher.get_num_connections(), "joint states, and a listener to commands")
    for topic, _ in rospy.get_published_topics():
        rospy.Subscriber(topic, rospy.AnyMsg, lambda _: None)
    start()
    rest = dict(zip(states[-1].name, states[-1].position))  # noqa: B905 - as of Python 3.8

    def rail() -> float:
        return float(states[-1].position[states[-1].name.index(names[0])])

    missed = []
    for number in range(count):
        goal = 0.05 if number % 2 else -0.05
        point = JointTrajectoryPoint(positions=[goal, *(rest[name] for name in names[1:])])
        point.time_from_start = rospy.Duration(0.5)  # a command that comes after its end is left out, as in ROS
        message = JointTrajectory(joint_names=names, points=[point])
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        end = rospy.Time.now() + rospy.Duration(2.0)
        while abs(rail() - goal) > 0.02 and rospy.Time.now() < end:
            rospy.sleep(0.02)
        if abs(rail() - goal) > 0.02:
            missed.append(number)
    stamps = [state.header.stamp.to_nsec() for state in tuple(states)]
    numbers = [state.header.seq for state in tuple(states)]
    return {"stamps": stamps, "numbers": numbers, "missed": missed}


def test_messages_beside_busy_processes_are_not_lost(master: Ground) -> None:
    for _ in range(os.cpu_count() or 1):
        master.start(["sh", "-c", "while :; do :; done"])
    cell = master.serve("lesson")
    os.setpriority(os.PRIO_PROCESS, bridge_of(cell), NICE)
    found = master.client(program, 15).value()
    periods = {later - earlier for earlier, later in zip(found["stamps"], found["stamps"][1:], strict=False)}
    assert len(found["stamps"]) > 50
    assert len(periods) == 1, periods
    assert found["numbers"] == list(range(found["numbers"][0], found["numbers"][0] + len(found["numbers"])))
    assert found["missed"] == []
    cell.interrupt()
    assert "dropped" not in cell.said
    assert "due" not in cell.said
