"""Commands over ROS: whole, in order, under the sender's name; a flood is cut, and counted."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.middleware.wire.command_queue import COMMAND_QUEUE, WINDOW
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, heard
from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]


def say(node: str, topic: str, count: int) -> None:
    import rospy
    from std_msgs.msg import String as RosString

    rospy.init_node(node)
    publisher = rospy.Publisher(topic, RosString, queue_size=count, tcp_nodelay=True)
    wait_until(publisher.get_num_connections, "connection")
    for number in range(count):
        publisher.publish(str(number))
    rospy.spin()  # the queue empties in its own thread


def words(cell: FakeCell) -> list[tuple[str, str]]:
    return [(frame.node, TYPES.from_ros1(frame.payload, String).data) for frame in cell.of(FrameKind.PUBLISH)]


def test_commands_reach_cell_whole_in_order_with_sender(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([heard("/words")])
    start_bridge(master, cell)
    master.client(say, "team", "/words", 50)
    wait_until(lambda: len(cell.of(FrameKind.PUBLISH)) == 50, "messages")
    assert words(cell) == [("/team", str(number)) for number in range(50)]
    frame = cell.of(FrameKind.PUBLISH)[0]
    assert (frame.name, frame.type) == ("/words", "std_msgs/String")


def test_some_commands_are_sent_at_a_time_and_oldest_dropped(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([heard("/words")])
    held: list[Frame] = []
    is_open = threading.Event()

    def answer(frame: Frame) -> Frame | None:
        if frame.kind is FrameKind.PUBLISH and not is_open.is_set():
            held.append(frame)
            return None
        return cell.usual(frame)

    cell.answer = answer
    bridge = start_bridge(master, cell)
    master.client(say, "team", "/words", COMMAND_QUEUE + 500)
    dropped = re.compile(r"^(\d+) messages on /words dropped: the cell is too slow$", re.MULTILINE)
    wait_until(
        lambda: sum(map(int, dropped.findall(bridge.said))) == 500 - WINDOW, "count of all", seen=lambda: bridge.said
    )
    assert len(cell.of(FrameKind.PUBLISH)) == WINDOW
    is_open.set()
    cell.send(Frame(FrameKind.REFUSED, held[0].number, name="MessageError", payload=b"no"))
    wait_until(lambda: len(cell.of(FrameKind.PUBLISH)) == COMMAND_QUEUE + WINDOW, "rest")
    assert [word for _, word in words(cell)] == [
        str(number) for number in (*range(WINDOW), *range(500, COMMAND_QUEUE + 500))
    ]


def say_too_much(node: str, topic: str, length: int) -> None:
    import rospy
    from std_msgs.msg import String as RosString

    rospy.init_node(node)
    publisher = rospy.Publisher(topic, RosString, queue_size=10)
    wait_until(publisher.get_num_connections, "connection")
    publisher.publish("x" * length)
    while not rospy.is_shutdown():  # the bridge connects to it again after a second
        publisher.publish("short")
        rospy.sleep(0.05)  # stands for no condition: repeated messages


def test_command_that_is_too_long_ends_connection(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([heard("/words")])
    bridge = start_bridge(master, cell)
    master.client(say_too_much, "team", "/words", 17 << 20)
    bridge.wait_for("messages on /words dropped: too long")
    wait_until(lambda: cell.of(FrameKind.PUBLISH), "messages after it")
    assert {word for _, word in words(cell)} == {"short"}


def test_commands_in_lockstep_are_not_dropped(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([heard("/words")], lockstep=True)
    start_bridge(master, cell)
    master.client(say, "team", "/words", 3000)
    wait_until(lambda: len(cell.of(FrameKind.PUBLISH)) == 3000, "messages")
    assert [word for _, word in words(cell)] == list(map(str, range(3000)))


def test_rostopic_pub_reaches_cell(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([heard("/words")])
    start_bridge(master, cell)
    master.tool("rostopic", "pub", "-1", "/words", "std_msgs/String", "hello")
    wait_until(lambda: cell.of(FrameKind.PUBLISH), "message")
    assert words(cell)[0][1] == "hello"
