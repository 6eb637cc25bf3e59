"""Lockstep over ROS: the step service advances time after published messages, and reports the sent ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.cellwright_msgs import StepRequest, StepResponse
from cellwright.middleware.messages.conversions import duration, stamp
from cellwright.middleware.messages.standard import String
from cellwright.middleware.ros1.bridge import message_bytes
from cellwright.middleware.wire.frames import Frame, FrameKind, read_advance
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, heard, out
from tests.middleware.ros1.bridge.wire import Calls, subscribe
from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]
STEP = "/cellwright/step"
TICK = 2_000_000
SECOND = 1_000_000_000


@pytest.fixture
def cell(master: Ground, make_cell: MakeCell) -> FakeCell:
    made = make_cell([out("/words"), out("/others"), heard("/commands")], lockstep=True)
    start_bridge(master, made)
    return made


def request(nanoseconds: int, **published: int) -> bytes:
    topics = [f"/{name}" for name in published]
    return TYPES.to_ros1(StepRequest(duration(nanoseconds), topics, np.array(list(published.values()), np.uint64)))


def step(master: Ground, nanoseconds: int, caller: str = "/test", **published: int) -> StepResponse:
    succeeded, data = Calls(master, STEP, caller=caller).call(request(nanoseconds, **published))
    assert succeeded
    return TYPES.from_ros1(data, StepResponse)


def tick_by_tick(cell: FakeCell) -> None:
    """Let the cell publish in each tick, and end the step there, as a cell does after a message to a client."""

    def answer(frame: Frame) -> Frame | None:
        if frame.kind is not FrameKind.ADVANCE:
            return cell.usual(frame)
        until_ns, _ = read_advance(frame)
        if cell.now < until_ns:
            cell.now += TICK
            cell.say("/words", TYPES.to_ros1(String(str(cell.now))))
        return Frame(FrameKind.TIME, frame.number, payload=cell.now.to_bytes(8, "little"))

    cell.answer = answer


def test_step_advances_time_by_duration(master: Ground, cell: FakeCell) -> None:
    tick_by_tick(cell)
    assert step(master, 100 * TICK).time == stamp(100 * TICK)
    answer = step(master, 3)
    assert (answer.success, answer.message, answer.time) == (True, "", stamp(101 * TICK))
    assert step(master, 0).time == stamp(101 * TICK)


def test_step_counts_messages_sent_since_caller_connected(master: Ground, cell: FakeCell) -> None:
    tick_by_tick(cell)
    step(master, 5 * TICK)
    mine, others = subscribe(master, "/words"), subscribe(master, "/others", caller="/somebody")
    answer = step(master, 7 * TICK)
    assert (answer.topics, answer.sent.tolist()) == (["/words"], [7])
    for number in range(6, 13):
        assert TYPES.from_ros1(mine.piece(), String).data == str(number * TICK)
    assert step(master, TICK, caller="/somebody").topics == ["/others"]
    others.close()


def test_step_response_lists_topic_of_newest_message_last(master: Ground, cell: FakeCell) -> None:
    connections = [subscribe(master, topic) for topic in ("/words", "/others")]

    def answer(frame: Frame) -> Frame | None:
        if frame.kind is FrameKind.ADVANCE and cell.now == 0 and read_advance(frame)[0]:
            cell.say("/others", TYPES.to_ros1(String("first")))
            cell.say("/words", TYPES.to_ros1(String("second")))
        return cell.usual(frame)

    cell.answer = answer
    answered = step(master, TICK)
    assert (answered.topics, answered.sent.tolist()) == (["/others", "/words"], [1, 1])
    assert [connection.piece()[4:] for connection in connections] == [b"second", b"first"]


def speak(topic: str, count: int) -> None:
    import rospy
    from std_msgs.msg import String as RosString

    rospy.init_node("speaker")
    publisher = rospy.Publisher(topic, RosString, queue_size=count)
    wait_until(publisher.get_num_connections, "connection")
    wait_until(lambda: rospy.get_param("/go", False), "permission")
    for number in range(count):
        publisher.publish(str(number))
    rospy.spin()  # the queue empties in its own thread


def test_step_waits_for_published_messages(master: Ground, cell: FakeCell) -> None:
    master.client(speak, "/commands", 20)
    wait_until(lambda: "/speaker" in str(master.ask("getSystemState")), "speaker")
    calls = Calls(master, STEP, caller="/speaker")
    calls.ask(request(TICK, commands=20))
    assert Calls(master, "/gazebo/get_loggers").call(b"")[0]  # earlier requests to the bridge have arrived
    assert not cell.of(FrameKind.ADVANCE)
    master.ask("setParam", "/go", True)
    succeeded, data = calls.answer()
    assert succeeded
    assert TYPES.from_ros1(data, StepResponse).success
    kinds = [frame.kind for frame in cell.frames]
    assert kinds.index(FrameKind.ADVANCE) > max(i for i, kind in enumerate(kinds) if kind is FrameKind.PUBLISH)
    assert len(cell.of(FrameKind.PUBLISH)) == 20


def test_step_with_missing_messages_fails_after_timeout(master: Ground, cell: FakeCell) -> None:
    answer = step(master, TICK, commands=3)
    assert not answer.success
    assert answer.message == "only 0 of 3 messages on /commands from /test arrived within 5 s"
    assert step(master, TICK).success


def test_step_with_invalid_request_is_refused(master: Ground, cell: FakeCell) -> None:
    assert step(master, TICK, words=1).message == "the cell does not subscribe to /words (known: /commands)"
    back = Calls(master, STEP).call(TYPES.to_ros1(StepRequest(duration(-5))))
    assert TYPES.from_ros1(back[1], StepResponse).message.startswith("duration must not be negative")
    succeeded, reason = Calls(master, STEP).call(b"abc")
    assert not succeeded
    assert reason.startswith(b"invalid request of cellwright_msgs/Step")


def test_steps_of_two_callers_are_queued(master: Ground, cell: FakeCell) -> None:
    tick_by_tick(cell)
    first, second = Calls(master, STEP, caller="/a"), Calls(master, STEP, caller="/b")
    first.ask(request(SECOND))
    second.ask(request(SECOND))
    times = [TYPES.from_ros1(calls.answer()[1], StepResponse).time for calls in (first, second)]
    # the order of the requests is open: they come by two connections
    assert sorted(times, key=lambda time: time.sec) == [stamp(SECOND), stamp(2 * SECOND)]


def test_step_of_disconnected_caller_ends(master: Ground, cell: FakeCell) -> None:
    tick_by_tick(cell)
    calls = Calls(master, STEP)
    calls.ask(request(2_000_000 * SECOND))
    wait_until(lambda: len(cell.of(FrameKind.ADVANCE)) > 10, "progress")
    calls.close()
    assert step(master, TICK).success


def test_rosservice_step_with_duration_only_succeeds(master: Ground, cell: FakeCell) -> None:
    said = master.tool("rosservice", "call", STEP, "{duration: {secs: 2}}")
    assert "success: True" in said
    assert "secs: 2" in said


def test_bridge_out_of_lockstep_has_no_step_service(master: Ground, make_cell: MakeCell) -> None:
    start_bridge(master, make_cell([out("/words")]))
    services = master.ask("getSystemState")[2]
    assert STEP not in [name for name, _ in services]
    assert message_bytes.STEP_TYPE == "cellwright_msgs/Step"
