"""Services over ROS: answers, failures, callers that vanish and callers that send nonsense."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, heard, out, service
from tests.middleware.ros1.bridge.wire import Calls, address_of_service, encoded, subscribe
from tests.ros1.ground import Ground, ground
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]
START = "/ariac/start_competition"


COMMAND = """
import rospy
from std_msgs.msg import String
rospy.init_node("hasty")
commands = rospy.Publisher("/commands", String, queue_size=1, latch=True)
commands.publish("go")
rospy.spin()
"""


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[tuple[Ground, FakeCell]]:
    """A master, and a cell with its bridge: calls of one test leave nothing for those of the next."""
    cell = FakeCell([], [service(START)])
    with closing(cell), ground(tmp_path_factory.mktemp("services"), ros1_messages) as made:
        start_bridge(made, cell)
        yield made, cell


@pytest.fixture
def served(shared: tuple[Ground, FakeCell]) -> Ground:
    """Environment of the shared cell."""
    return shared[0]


@pytest.fixture
def cell(shared: tuple[Ground, FakeCell]) -> FakeCell:
    """The shared cell, in its initial state."""
    cell = shared[1]
    cell.reset()
    return cell


def answering(cell: FakeCell, kind: FrameKind, payload: bytes, name: str = "") -> None:
    def answer(frame: Frame) -> Frame | None:
        if frame.kind is FrameKind.CALL:
            return Frame(kind, frame.number, name=name, payload=payload)
        return cell.usual(frame)

    cell.answer = answer


def test_call_returns_answer_of_cell(served: Ground, cell: FakeCell) -> None:
    answering(cell, FrameKind.ANSWER, b"\1\2\0\0\0ok")
    calls = Calls(served, START, caller="/team", md5sum=TYPES.md5("std_srvs/Trigger"))
    assert calls.header["type"] == "std_srvs/Trigger"
    assert calls.header["md5sum"] == TYPES.md5("std_srvs/Trigger")
    assert calls.call(b"") == (True, b"\1\2\0\0\0ok")
    with pytest.raises(EOFError):  # one call for each connection
        calls.read(1)
    (frame,) = cell.of(FrameKind.CALL)
    assert (frame.name, frame.type, frame.node, frame.payload) == (START, "std_srvs/Trigger", "/team", b"")


def test_persistent_connection_carries_several_calls(served: Ground, cell: FakeCell) -> None:
    cell.answer = lambda frame: Frame(FrameKind.ANSWER, frame.number, payload=frame.payload[::-1])
    calls = Calls(served, START, persistent="1")
    assert [calls.call(data) for data in (b"abc", b"", b"xy")] == [(True, b"cba"), (True, b""), (True, b"yx")]
    for data in (b"one", b"two", b"three"):  # without waiting for answers
        calls.ask(data)
    assert [calls.answer() for _ in range(3)] == [(True, b"eno"), (True, b"owt"), (True, b"eerht")]


def test_slow_answer_blocks_no_other_caller(master: Ground, make_cell: MakeCell) -> None:
    """For example a robot's motion to home."""
    cell = make_cell([out("/words"), heard("/commands")], [service("/home"), service("/other")])
    cell.answer = lambda frame: None if frame.name == "/home" else cell.usual(frame)
    start_bridge(master, cell)
    words = subscribe(master, "/words")
    cell.wait_for_listener("/words")
    waiting = Calls(master, "/home", caller="/patient")
    waiting.ask(b"")
    wait_until(lambda: cell.of(FrameKind.CALL), "call")
    (asked,) = cell.of(FrameKind.CALL)
    assert Calls(master, "/other").call(b"") == (True, b"")
    assert Calls(master, "/home", probe="1").header["type"] == "std_srvs/Trigger"
    cell.say("/words", b"\2\0\0\0up")
    assert words.piece() == b"\2\0\0\0up"
    master.client(COMMAND)
    wait_until(lambda: cell.of(FrameKind.PUBLISH), "command")
    cell.send(Frame(FrameKind.ANSWER, asked.number, payload=b"home"))
    assert waiting.answer() == (True, b"home")


def test_call_in_lockstep_gets_answer_after_done(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([], [service("/home")], lockstep=True)
    cell.answer = lambda frame: Frame(FrameKind.DONE, frame.number) if frame.name == "/home" else cell.usual(frame)
    start_bridge(master, cell)
    waiting = Calls(master, "/home")
    waiting.ask(b"")
    wait_until(lambda: cell.of(FrameKind.CALL), "call")
    cell.send(Frame(FrameKind.ANSWER, cell.of(FrameKind.CALL)[0].number, payload=b"home"))
    assert waiting.answer() == (True, b"home")


def test_failed_service_fails_like_cpp_service_returning_false(served: Ground, cell: FakeCell) -> None:
    answering(cell, FrameKind.REFUSED, b"the state is not go", "ServiceFailedError")
    assert Calls(served, START).call(b"") == (False, b"")


def test_refused_call_fails_with_reason_in_one_line(served: Ground, cell: FakeCell) -> None:
    answering(cell, FrameKind.REFUSED, b"no\n  such", "MessageError")
    calls = Calls(served, START, persistent="1")
    assert calls.call(b"") == (False, b"no such")
    answering(cell, FrameKind.ANSWER, b"\1")
    assert calls.call(b"") == (True, b"\1")


def test_call_with_other_checksum_is_refused(served: Ground, cell: FakeCell) -> None:
    header = Calls(served, START, md5sum="0" * 32).header
    assert header["error"].startswith(f"{START} has md5sum 937c9679")


def test_killed_caller_affects_no_other(served: Ground, cell: FakeCell) -> None:
    waiting: list[Frame] = []

    def keep(frame: Frame) -> Frame | None:
        if frame.kind is not FrameKind.CALL:
            return cell.usual(frame)
        waiting.append(frame)
        return None

    cell.answer = keep
    calls = Calls(served, START)
    calls.ask(b"")
    wait_until(lambda: waiting, "call")
    calls.close()
    cell.send(Frame(FrameKind.ANSWER, waiting[0].number, payload=b"\1"))
    answering(cell, FrameKind.ANSWER, b"\2")
    assert Calls(served, START).call(b"") == (True, b"\2")


def test_request_that_is_too_long_ends_connection(served: Ground, cell: FakeCell) -> None:
    calls = Calls(served, START, persistent="1")
    calls.socket.sendall(struct.pack("<I", 0xFFFFFFFF))
    with pytest.raises(EOFError):
        calls.read(1)
    assert Calls(served, START).call(b"")[0]


@pytest.mark.parametrize(
    "data",
    [
        struct.pack("<I", 0xFFFFFFF0) + b"x",
        b"GET / HTTP/1.1\r\n\r\n",
        struct.pack("<II", 8, 100) + b"abcd",
        struct.pack("<II", 7, 3) + b"abc",
        struct.pack("<II", 6, 2) + b"\xff=",
        encoded({"callerid": "/x"}),
        encoded({"service": START, "callerid": "/x"}),
        encoded({"topic": "/none", "callerid": "/x", "md5sum": "*"}),
    ],
)
def test_invalid_handshake_is_refused(data: bytes, served: Ground, cell: FakeCell) -> None:
    with socket.create_connection(address_of_service(served, START), TIMEOUT) as connection:
        connection.sendall(data)
        connection.settimeout(TIMEOUT)
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(4096):
            pass
    assert Calls(served, START).call(b"")[0]


def test_silent_connections_block_no_other(served: Ground, cell: FakeCell) -> None:
    address = address_of_service(served, START)
    silent = [socket.create_connection(address, TIMEOUT) for _ in range(50)]
    assert Calls(served, START).call(b"")[0]
    for connection in silent:
        connection.close()


def test_ros_tools_show_service(served: Ground, cell: FakeCell) -> None:
    answering(cell, FrameKind.ANSWER, b"\1\2\0\0\0ok")
    assert served.tool("rosservice", "type", START) == "std_srvs/Trigger\n"
    assert "success: True" in served.tool("rosservice", "call", START)
    assert "Args: \n" in served.tool("rosservice", "info", START)
    answering(cell, FrameKind.REFUSED, b"not so", "RejectedCommandError")
    served.tool("rosservice", "call", START, status=2)
    assert "rospy.topics" in served.tool("rosservice", "call", "/gazebo/get_loggers")  # rospy's own still work
