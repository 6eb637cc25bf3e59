"""Playback for ROS 1 programs: the same messages, in simulation time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.recording.format.reader import RecordingFile
from tests.recording.replay.made import record, short_work
from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

STATES, ORDERS, COMMAND = "/ariac/joint_states", "/ariac/orders", "/ariac/arm/command"


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[tuple[Ground, Path]]:
    """Play a recording in a loop, beside a master."""
    folder = tmp_path_factory.mktemp("replay")
    path = record(folder / "run.mcap", short_work)
    with ground(folder, ros1_messages) as made:
        player = made.cellwright("replay", str(path), "--ros1", "--loop", "--speed", "3", "--port", "0")
        player.wait_for("^ready")
        yield made, path


def listen() -> dict[str, Any]:
    """Listen for more than a round: joint states (stamps, positions), ends of rounds, orders, goals."""
    import threading

    import rospy
    from osrf_gear.msg import Order
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory

    rospy.init_node("listener", anonymous=True)
    heard = {"states": [], "orders": [], "goals": [], "ends": []}  # type: ignore[var-annotated]
    change = threading.Condition()

    def note(kind: str, what: Any) -> None:
        with change:
            heard[kind].append(what)
            change.notify_all()

    def take(message: JointState) -> None:
        stamp = message.header.stamp.to_nsec()
        if heard["states"] and stamp < heard["states"][-1][0]:
            heard["ends"].append(len(heard["states"]))
        note("states", [stamp, list(message.position)])

    rospy.Subscriber("/ariac/joint_states", JointState, take)
    rospy.Subscriber("/ariac/orders", Order, lambda m: note("orders", m.order_id))
    rospy.Subscriber("/ariac/arm/command", JointTrajectory, lambda m: note("goals", list(m.points[0].positions)))
    with change:
        assert change.wait_for(lambda: len(heard["ends"]) >= 2, TIMEOUT)
    return heard


def test_ros1_subscriber_gets_recorded_messages(played: tuple[Ground, Path]) -> None:
    master, path = played
    heard = master.client(listen).value()

    with RecordingFile(path) as recording:
        states = [recording.decode(each) for each in recording.messages([STATES])]
        goals = [recording.decode(each) for each in recording.messages([COMMAND])]
    recorded = [[each.header.stamp.sec * 10**9 + each.header.stamp.nanosec, each.position.tolist()] for each in states]
    first, second = heard["ends"][:2]
    assert heard["states"][first:second] == recorded, "all of a round, and nothing else"
    assert heard["goals"][0] == list(goals[0].points[0].positions)
    assert set(heard["orders"]) == {"order_0"}


def test_ros1_command_to_recording_is_refused(played: tuple[Ground, Path]) -> None:
    master, _ = played

    assert master.ask("getParam", "/use_sim_time") is True
    published = {name for name, _ in master.ask("getPublishedTopics", "")}
    assert {"/clock", STATES, ORDERS, COMMAND, "/tf", "/tf_static"} <= published
    state = master.ask("getSystemState")
    services = {name for name, _ in state[2]}
    assert "/ariac/start_competition" not in services
