"""Publications of the cell in ROS: typed, in order, latched once, and only while they have a subscriber."""

from __future__ import annotations

import struct
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import stamp
from cellwright.middleware.messages.standard import Header, String
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, out
from tests.middleware.ros1.bridge.wire import Connection, subscribe
from tests.ros1.ground import Ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]
QUEUE = 1000
"""Most messages that wait for a subscriber: `PUBLICATION_QUEUE` of the bridge's `topics`."""


def text(words: str) -> bytes:
    return TYPES.to_ros1(String(words))


def word(connection: Connection) -> str:
    return TYPES.from_ros1(connection.piece(), String).data


def test_publication_header_has_type_checksum_and_latch(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words"), out("/last", latch=True, on_event=True)])
    start_bridge(master, cell)
    plain = subscribe(master, "/words", md5sum=TYPES.md5("std_msgs/String"), type="std_msgs/String").header
    assert plain == {
        "topic": "/words",
        "type": "std_msgs/String",
        "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1",
        "message_definition": TYPES.definition("std_msgs/String"),
        "latching": "0",
        "callerid": "/gazebo",
    }
    assert subscribe(master, "/last").header["latching"] == "1"


def test_subscriber_of_other_type_is_refused_with_reason(master: Ground, make_cell: MakeCell) -> None:
    bridge = start_bridge(master, make_cell([out("/words")]))
    refused = subscribe(master, "/words", type="std_msgs/Float32", md5sum=TYPES.md5("std_msgs/Float32"))
    assert refused.header == {"error": "/words has type std_msgs/String, not std_msgs/Float32"}
    with pytest.raises(EOFError):
        refused.read(1)
    assert "md5sum 992ce8a1" in subscribe(master, "/words", md5sum="0" * 32).header["error"]
    bridge.wait_for("/test cannot connect: /words has type")


def test_bridge_subscribes_only_while_it_has_subscribers(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words"), out("/once", latch=True, on_event=True)])
    start_bridge(master, cell)
    cell.wait_for_listener("/once")
    assert [frame.name for frame in cell.of(FrameKind.SUBSCRIBE)] == ["/once"]
    first, second = subscribe(master, "/words", caller="/a"), subscribe(master, "/words", caller="/b")
    cell.say_heard("/words", text("both"))
    assert word(first) == word(second) == "both"
    assert cell.listeners("/words") == 1
    first.close()
    cell.say_heard("/words", text("one"))
    assert word(second) == "one"
    second.close()
    wait_until(lambda: cell.listeners("/words") == 0, "end of the subscription")
    assert cell.listeners("/once") == 1


def test_late_subscriber_of_latched_topic_gets_newest_once(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words", latch=True)])
    start_bridge(master, cell)
    first = subscribe(master, "/words", caller="/a")
    for words in ("old", "new"):
        cell.say_heard("/words", text(words))
    assert [word(first), word(first)] == ["old", "new"]
    late = subscribe(master, "/words", caller="/b")
    cell.say_heard("/words", text("newest"))
    assert [word(late), word(late)] == ["new", "newest"]
    assert word(first) == "newest"


def test_handshake_is_answered_after_latched_messages(master: Ground, make_cell: MakeCell) -> None:
    """Latched messages come before the answer, so that a program has them before it connects to another topic."""
    cell = make_cell([out("/words", latch=True)])
    asked: list[Frame] = []

    def hold_back(frame: Frame) -> Frame | None:
        if frame.kind is not FrameKind.SUBSCRIBE:
            return cell.usual(frame)
        asked.append(frame)
        return None

    cell.answer = hold_back
    start_bridge(master, cell)
    with ThreadPoolExecutor() as pool:
        coming = pool.submit(subscribe, master, "/words")
        wait_until(lambda: asked, "subscription at the cell")
        cell.say("/words", text("latched"))
        assert not coming.done()
        cell.send(Frame(FrameKind.DONE, asked[0].number))
        assert word(coming.result(TIMEOUT)) == "latched"
    assert len(asked) == 1


def test_latched_message_is_outdated_after_last_subscriber_left(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words", latch=True)])
    start_bridge(master, cell)
    first = subscribe(master, "/words")
    cell.say_heard("/words", text("stale"))
    assert word(first) == "stale"
    first.close()
    wait_until(lambda: cell.listeners("/words") == 0, "end of the subscription")
    late = subscribe(master, "/words")
    cell.say_heard("/words", text("fresh"))
    assert word(late) == "fresh"  # and nothing before it


def test_latched_message_reaches_each_subscriber_once(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/orders", latch=True, on_event=True)])
    start_bridge(master, cell)
    subscribers = []
    for number in range(60):
        subscribers.append(subscribe(master, "/orders", caller=f"/c{number}"))
        if number == 30:  # while others arrive
            cell.say_heard("/orders", text("order_0"))
    for subscriber in subscribers:
        assert word(subscriber) == "order_0"
    cell.say("/orders", text("order_1"))
    assert {word(subscriber) for subscriber in subscribers} == {"order_1"}


def test_header_sequence_is_counted_by_publisher(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/heads", "std_msgs/Header"), out("/stamped", "sensor_msgs/Range")])
    start_bridge(master, cell)
    plain, stamped = subscribe(master, "/heads"), subscribe(master, "/stamped")
    bare = TYPES.to_ros1(Header(stamp(5), "there"))
    for _ in range(3):
        cell.say_heard("/heads", bare)
        cell.say_heard("/stamped", bare + bytes(17))
    assert [plain.piece() for _ in range(3)] == [bare] * 3  # a header of another message stays untouched
    counted = [stamped.piece() for _ in range(3)]
    assert [struct.unpack("<I", data[:4])[0] for data in counted] == [0, 1, 2]
    assert {data[4:] for data in counted} == {(bare + bytes(17))[4:]}


def test_slow_subscriber_loses_oldest_and_blocks_no_other(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words")])
    bridge = start_bridge(master, cell)
    stalled = subscribe(master, "/words", caller="/stalled", receive_buffer=4096)
    reading = subscribe(master, "/words", caller="/reading")
    filler = "x" * 20_000
    count = 1400
    for number in range(count):
        cell.say_heard("/words", text(f"{number} {filler}"))
        assert word(reading).startswith(f"{number} ")
    bridge.wait_for(r"subscriber /stalled on /words is too slow: \d+ messages dropped")
    got = [int(word(stalled).split()[0])]
    while got[-1] < count - 1:
        got.append(int(word(stalled).split()[0]))
    assert got == sorted(got)
    assert len(got) < count
    assert got[-1000:] == list(range(count - 1000, count))  # the newest are all there


def test_publication_omits_messages_of_other_nodes(master: Ground, make_cell: MakeCell) -> None:
    both = out("/tf", "tf2_msgs/TFMessage") | {"publishers": ["/robot_state_publisher", "/gazebo"]}
    cell = make_cell([both])
    start_bridge(master, cell)  # without robot_state_publisher the bridge publishes everything
    subscribe(master, "/tf")
    cell.wait_for_listener("/tf")
    assert [frame.node for frame in cell.of(FrameKind.SUBSCRIBE)] == [""]


def hear_with_rospy(topic: str, count: int) -> list[str]:
    import rospy
    from std_msgs.msg import String as RosString

    rospy.init_node("listener")
    heard: list[str] = []
    rospy.Subscriber(topic, RosString, lambda message: heard.append(message.data))
    wait_until(lambda: len(heard) == count, "messages", seen=lambda: len(heard))
    return heard


def test_thousand_messages_at_once_reach_rospy_without_loss(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words")])
    start_bridge(master, cell)
    count = QUEUE  # more may be dropped if rospy does not keep up
    client = master.client(hear_with_rospy, "/words", count)
    wait_until(lambda: cell.listeners("/words") == 1, "subscription")
    for number in range(count):
        cell.say_heard("/words", text(str(number)))
    assert client.value() == [str(number) for number in range(count)]


def test_ros_tools_show_publication(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/words", latch=True, on_event=True)])
    start_bridge(master, cell)
    cell.say_heard("/words", text("so"))
    assert 'data: "so"' in master.tool("rostopic", "echo", "-n", "1", "/words")
    assert master.tool("rostopic", "type", "/words") == "std_msgs/String\n"
    listener = master.start(["rostopic", "echo", "/words"])
    listener.wait_for("so")
    info = master.tool("rosnode", "info", "/gazebo")
    assert "* /words [std_msgs/String]" in info
    assert "* topic: /words\n    * to: /rostopic_" in info
