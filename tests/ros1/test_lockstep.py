"""Lockstep: only a service advances time, exactly, and in the same way for every client."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, has_publisher, wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    with ground(tmp_path_factory.mktemp("lockstep"), ros1_messages) as made:
        made.serve("lesson", "--lockstep")
        yield made


def test_rosservice_step_advances_time_by_duration(cell: Ground) -> None:
    times = []
    for duration in ("{secs: 1}", "{secs: 0, nsecs: 2000000}", "{nsecs: 1}", "{}"):
        said = cell.tool("rosservice", "call", "/cellwright/step", f"{{duration: {duration}}}")
        assert "success: True" in said
        found = re.search(r"secs: (\d+)\s+nsecs:\s+(\d+)", said)
        assert found is not None
        times.append(int(found[1]) * 10**9 + int(found[2]))
    assert [b - a for a, b in pairwise(times)] == [2_000_000, 2_000_000, 0]


def count(seconds: int) -> dict[str, list[float]]:
    """Advance time in steps, and receive everything meanwhile: return stamps of joint states and laser profiles."""
    import threading
    from functools import partial

    import rospy
    from cellwright_msgs.srv import Step
    from sensor_msgs.msg import JointState, LaserScan

    # No node on simulation time: it would wait for time that only it advances.
    rospy.init_node("stepper", anonymous=True)
    stamps, change = {"/ariac/joint_states": [], "/ariac/laser_profiler": []}, threading.Condition()  # type: ignore[var-annotated]

    def note(message: object, topic: str) -> None:
        with change:
            stamps[topic].append(message.header.stamp.to_sec())  # type: ignore[attr-defined]
            change.notify_all()

    def is_come(topic: str, sent: int) -> bool:
        return len(stamps[topic]) >= sent

    subscribers = [
        rospy.Subscriber(topic, kind, note, callback_args=topic)
        for topic, kind in (("/ariac/joint_states", JointState), ("/ariac/laser_profiler", LaserScan))
    ]
    step = rospy.ServiceProxy("/cellwright/step", Step, persistent=True)
    step.wait_for_service(TIMEOUT)
    wait_until(lambda: all(has_publisher(each) for each in subscribers), "connections")
    for _ in range(10 * seconds):
        answer = step(rospy.Duration(0, 100_000_000), list(stamps), [0, 0])
        assert answer.success, answer.message
        with change:
            for topic, sent in zip(answer.topics, answer.sent, strict=True):
                if topic in stamps:
                    assert change.wait_for(partial(is_come, topic, sent), TIMEOUT), (topic, sent, len(stamps[topic]))
    return stamps


def test_messages_in_lockstep_arrive_complete_and_on_time(cell: Ground) -> None:
    """At full speed: each message of ten seconds arrives, at its time."""
    stamps = cell.client(count, 10).value()
    for topic, period in (("/ariac/joint_states", 0.02), ("/ariac/laser_profiler", 0.01)):
        found = stamps[topic]
        assert len(found) in (round(10 / period), round(10 / period) + 1)
        assert [round(b - a, 6) for a, b in pairwise(found)] == [period] * (len(found) - 1)
