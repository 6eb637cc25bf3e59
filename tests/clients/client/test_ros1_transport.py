"""A client over ROS 1, through the relay: its messages, and its end."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess, Transport
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.running.run import RunOptions, run_cell
from cellwright.util.errors import (
    MessageError,
    RejectedCommandError,
    RunEndedError,
    ServiceFailedError,
    UnknownNameError,
    UsageError,
)
from cellwright.util.process import ChildProcess
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, heard, out, service
from tests.ros1.client import warm_ros
from tests.ros1.ground import Ground
from tests.ros1.requirement import ros_python
from tests.support import watching
from tests.support.waiting import TIMEOUT, wait_until
from tests.support.warm import WarmProcess
from tests.support.watching import Action

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]
START = "/ariac/start_competition"
TICK = 2_000_000
TOPICS = [
    out("/clock", "rosgraph_msgs/Clock"),
    out("/words"),
    out("/more"),
    out("/once", latch=True, on_event=True),
    heard("/commands"),
    heard("/arm", "trajectory_msgs/JointTrajectory"),
]


def forked_relay(command: list[str], *, env: dict[str, str], stderr: IO[bytes], **_: object) -> WarmProcess:
    """Start a relay without the start of an interpreter, in place of `subprocess.Popen`."""
    return warm_ros().popen(command, folder=Path.cwd(), environment=env, stdin=True, stderr=stderr)


@contextmanager
def over_ros(master: Ground, *, cold: bool = False, **more: Any) -> Iterator[Ros1Transport]:
    """Yield a client of the server at a master.

    Args:
        master: the master.
        cold: start an interpreter for its relay; otherwise the relay is forked from one that has loaded rospy.
        more: arguments of the transport.
    """
    with pytest.MonkeyPatch.context() as patched:
        if not cold:
            patched.setattr(ChildProcess, "_popen", staticmethod(forked_relay))
        transport = Ros1Transport(str(ros_python()), environment=master.environment, timeout=TIMEOUT, **more)
    try:
        yield transport
    finally:
        transport.close()


@contextmanager
def ticking(cell: FakeCell) -> Iterator[None]:
    """Let time pass in the cell, by wall time, a tick every few milliseconds."""
    is_over = threading.Event()

    def tick() -> None:
        while not is_over.wait(0.002):
            cell.now += TICK
            seconds, rest = divmod(cell.now, 1_000_000_000)
            cell.say("/clock", seconds.to_bytes(4, "little") + rest.to_bytes(4, "little"))

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


@pytest.fixture
def live(master: Ground, make_cell: MakeCell) -> Iterator[tuple[FakeCell, Ros1Transport]]:
    """A cell whose time passes independently, and a client."""
    cell = make_cell(TOPICS, [service(START)])
    start_bridge(master, cell)
    with ticking(cell), over_ros(master, node="/team") as transport:
        yield cell, transport


@pytest.fixture
def locked(master: Ground, make_cell: MakeCell) -> Iterator[tuple[FakeCell, Ros1Transport]]:
    """A cell in lockstep, and a client."""
    cell = make_cell(TOPICS, [service(START)], lockstep=True)
    start_bridge(master, cell)
    with over_ros(master, node="/team") as transport:
        yield cell, transport


def test_live_client_receives_messages_and_time_passes(live: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = live
    heard_words: list[str] = []
    begin = transport.now()
    assert begin > 0
    leave = transport.subscribe("/words", lambda message: heard_words.append(message.data))
    wait_until(lambda: cell.listeners("/words") == 1, "subscription")  # it may arrive after `subscribe` returns
    for word in ("one", "two"):
        cell.say("/words", TYPES.to_ros1(String(word)))
    transport.advance(None, lambda: len(heard_words) == 2)
    assert heard_words == ["one", "two"]
    assert transport.now() > begin
    leave()
    wait_until(lambda: cell.listeners("/words") == 0, "end of the subscription")
    assert cell.listeners("/clock") > 0


def test_latched_message_reaches_every_callback(live: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = live
    cell.say("/once", TYPES.to_ros1(String("order")))
    got: list[tuple[int, str]] = []
    for number in range(2):
        transport.subscribe("/once", lambda message, number=number: got.append((number, message.data)))  # type: ignore[misc]
        transport.advance(None, lambda number=number: len(got) > number)  # type: ignore[misc]
    assert got == [(0, "order"), (1, "order")]


def test_published_messages_have_node_name_and_type(live: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = live
    for number in range(20):
        transport.publish("/commands", String(str(number)))
    wait_until(lambda: len(cell.of(FrameKind.PUBLISH)) == 20, "messages")
    frames = cell.of(FrameKind.PUBLISH)
    assert [TYPES.from_ros1(frame.payload, String).data for frame in frames] == [str(number) for number in range(20)]
    assert {(frame.node, frame.type) for frame in frames} == {("/team", "std_msgs/String")}


def test_service_calls_return_response_or_error(live: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = live
    answer: list[tuple[FrameKind, str, bytes]] = [
        (FrameKind.ANSWER, "", TYPES.to_ros1(TriggerResponse(success=True, message="go")))
    ]

    def answered(frame: Frame) -> Frame | None:
        kind, name, payload = answer[0]
        return Frame(kind, frame.number, name, payload=payload) if frame.kind is FrameKind.CALL else cell.usual(frame)

    cell.answer = answered
    assert transport.call(START, TriggerRequest()) == TriggerResponse(success=True, message="go")
    answer[0] = (FrameKind.REFUSED, "RejectedCommandError", b"not now")
    with pytest.raises(RejectedCommandError, match="not now"):
        transport.call(START, TriggerRequest())
    answer[0] = (FrameKind.REFUSED, "ServiceFailedError", b"")
    with pytest.raises(ServiceFailedError, match="no answer"):
        transport.call(START, TriggerRequest())
    assert {frame.node for frame in cell.of(FrameKind.CALL)} == {"/team"}


def test_wrong_names_and_types_are_refused(live: tuple[FakeCell, Ros1Transport]) -> None:
    _, transport = live
    with pytest.raises(UnknownNameError, match=START):
        transport.call("/ariac/start", TriggerRequest())
    with pytest.raises(UnknownNameError, match="/commands"):
        transport.publish("/command", String(""))
    with pytest.raises(MessageError, match="/arm takes trajectory_msgs/JointTrajectory"):
        transport.publish("/arm", String(""))


def test_lockstep_messages_arrive_in_publishing_order(locked: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = locked
    rounds = 30

    def answered(frame: Frame) -> Frame | None:
        if frame.kind is not FrameKind.ADVANCE:
            return cell.usual(frame)
        aim = int.from_bytes(frame.payload[:8], "little", signed=True)
        if cell.now < aim:
            cell.now += TICK
            number = cell.now // TICK
            for topic in ("/words", "/more")[:: 1 if number % 2 else -1]:
                cell.say(topic, TYPES.to_ros1(String(f"{topic} {number}")))
        return Frame(FrameKind.TIME, frame.number, payload=cell.now.to_bytes(8, "little"))

    cell.answer = answered
    got: list[tuple[int, str]] = []
    for topic in ("/words", "/more"):
        transport.subscribe(topic, lambda message: got.append((transport.now() // TICK, message.data)))
    transport.advance(rounds * TICK)
    assert got == [
        (number, f"{topic} {number}")
        for number in range(1, rounds + 1)
        for topic in ("/words", "/more")[:: 1 if number % 2 else -1]
    ]
    assert transport.now() == rounds * TICK


def test_lockstep_call_or_advance_does_not_overtake_command(locked: tuple[FakeCell, Ros1Transport]) -> None:
    cell, transport = locked
    empty = TYPES.to_ros1(TriggerResponse())
    cell.answer = lambda frame: (
        Frame(FrameKind.ANSWER, frame.number, payload=empty) if frame.kind is FrameKind.CALL else cell.usual(frame)
    )
    for number in range(10):
        transport.publish("/commands", String(str(number)))
        if number % 2:
            transport.call(START, TriggerRequest())
        else:
            transport.advance(transport.now() + TICK)
    kinds = [frame.kind for frame in cell.frames if frame.kind in (FrameKind.PUBLISH, FrameKind.CALL)]
    assert kinds == [FrameKind.PUBLISH, FrameKind.PUBLISH, FrameKind.CALL] * 5
    published = 0
    for frame in cell.frames:
        if frame.kind is FrameKind.PUBLISH:
            published += 1
        elif frame.kind is FrameKind.ADVANCE and int.from_bytes(frame.payload[:8], "little"):
            assert published >= cell_ticks(frame)


def cell_ticks(frame: Frame) -> int:
    """Return the number of messages that must have come before this request to advance."""
    return 2 * (int.from_bytes(frame.payload[:8], "little") // TICK) - 1


@pytest.mark.parametrize("in_lockstep", [False, True])
def test_end_of_cell_ends_run(in_lockstep: bool, master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell(TOPICS, [service(START)], lockstep=in_lockstep)
    start_bridge(master, cell)
    with ticking(cell):
        transport = Ros1Transport(str(ros_python()), environment=master.environment, timeout=TIMEOUT)
    cell.answer = lambda frame: None if frame.kind is FrameKind.ADVANCE else cell.usual(frame)
    cell.send(Frame(FrameKind.ENDED, payload=b"over"))
    with pytest.raises(RunEndedError, match="the cell has ended"):
        transport.advance(None, lambda: False)
    transport.close()
    assert not transport._relay.is_running


def test_relay_ends_with_client(locked: tuple[FakeCell, Ros1Transport]) -> None:
    _, transport = locked
    transport.close()
    assert transport._relay._process.returncode == 0
    transport.close()


def test_killed_relay_ends_run(locked: tuple[FakeCell, Ros1Transport]) -> None:
    _, transport = locked
    os.kill(transport._relay._process.pid, signal.SIGKILL)
    with pytest.raises(RunEndedError):
        transport.advance(None, lambda: False)


def test_missing_master_is_reported(no_master: Ground) -> None:
    with pytest.raises(UsageError, match="no ROS master answers at"):
        Ros1Transport(str(ros_python()), environment=no_master.environment, timeout=0.5)


def test_missing_simulator_is_reported(master: Ground) -> None:
    with pytest.raises(UsageError, match=r"no simulator at .*: /clock has no publisher"):
        Ros1Transport(str(ros_python()), environment=master.environment, timeout=0.5)


def test_other_sign_topic_replaces_clock(master: Ground, make_cell: MakeCell) -> None:
    cell = make_cell([out("/io_teleop/joint_states"), heard("/commands")])
    start_bridge(master, cell)
    with over_ros(master, sign="/io_teleop/joint_states") as transport:
        heard_words: list[str] = []
        transport.subscribe("/io_teleop/joint_states", lambda message: heard_words.append(message.data))
        before = transport.now()
        cell.say_heard("/io_teleop/joint_states", TYPES.to_ros1(String("here")))
        transport.advance(before + 5_000_000_000, lambda: bool(heard_words))
        assert heard_words == ["here"]
        assert transport.now() > before
        cell.send(Frame(FrameKind.ENDED, payload=b"over"))
        with pytest.raises(RunEndedError, match="the cell has ended"):
            transport.advance(transport.now() + 20_000_000_000)


def test_missing_interpreter_is_reported() -> None:
    with pytest.raises(UsageError, match="/nowhere/python3 cannot be started: No such file"):
        Ros1Transport("/nowhere/python3")


def test_missing_rospy_is_reported(tmp_path: Path) -> None:
    program = tmp_path / "python3"
    program.write_text("#!/bin/sh\necho no module named rospy >&2\nexit 1\n")
    program.chmod(0o755)
    with pytest.raises(UsageError, match="no module named rospy"):
        Ros1Transport(str(program))


def work(client: Client) -> None:
    """A little of everything."""
    client.start_competition()
    client.wait_for_order(timeout=1.0)
    client.control_gripper(True)
    client.send_arm([[2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0]], times=[0.5])
    beam = client.sensor("break_beam")
    client.wait_until(lambda: beam.count >= 2, timeout=1.0)
    client.sleep(0.2)
    client.control_gripper(False)


class Worker:
    def run(self, client: Client) -> None:
        work(client)
        client.sleep(10.0)


def test_lockstep_run_ends_in_state_of_in_process_run(no_master: Ground) -> None:
    seconds = 1.2
    trial = load_trial([find_trial("lesson")]).trial
    alone = run_cell(Cell(replace(trial), seed=1), Worker(), RunOptions(until=seconds))
    cell = no_master.serve("lesson", "--lockstep", "--seed", "1", "--until", str(seconds), "--json")
    with over_ros(no_master, cold=True) as transport:
        run_to_the_end(transport)
    assert cell.finish() == 0
    assert json.loads(cell.out)["state_hash"] == alone.state_hash


LATE: list[Action] = [
    ("wait", 110),
    ("subscribe", "/ariac/break_beam"),
    ("subscribe", "/ariac/logical_camera"),
    ("move", 0),
    ("wait", 20),
    ("subscribe", "/ariac/laser_profiler"),
    ("subscribe", "/ariac/logical_camera"),
    ("subscribe", "/ariac/arm/follow_joint_trajectory/status"),
    ("move", 1),
    ("wait", 70),
    ("move", 2),
]


@pytest.mark.parametrize("others", [(), ("/ariac/logical_camera", "/ariac/laser_profiler", "/tf")])
def test_lockstep_agent_observes_same_with_other_subscribers(no_master: Ground, others: tuple[str, ...]) -> None:
    expected = watching.work(InProcess(Cell(load_trial([find_trial("lesson")]).trial, seed=1)), LATE)
    no_master.serve("lesson", "--lockstep", "--seed", "1", "--record", "run.mcap")
    for topic in others:
        no_master.start(["rostopic", "echo", "--noarr", topic])
    wait_until(
        lambda: set(others) <= {name for name, _ in no_master.ask("getSystemState")[1]}, "subscription of the others"
    )
    with over_ros(no_master) as transport:
        assert watching.work(transport, LATE) == expected


def run_to_the_end(transport: Transport) -> None:
    with pytest.raises(RunEndedError):
        Worker().run(Client(transport))
