"""A client whose cell is served; here by a thread of this process, the cell's only user."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import socket_transport as socket_module
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess, Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, SubmitTrayRequest
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.running.run import RunOptions, RunResult, ServerOptions, Session, SessionResult
from cellwright.util.errors import (
    MessageError,
    RejectedCommandError,
    RunEndedError,
    ServiceFailedError,
    UnknownNameError,
    UsageError,
)
from tests.cell.arm_cells import ur5_cell
from tests.clients.operators import nodes as robots
from tests.support.cells import ARM_ONLY, INITIAL, KITTING, WHOLE, way
from tests.support.waiting import TIMEOUT, wait_until


class ServedCell:
    """A served cell; `result` is there when it is over."""

    def __init__(self, cell: Cell, *, lockstep: bool, speed: float | None, options: RunOptions) -> None:
        here = ServerOptions(port=0, lockstep=lockstep)
        self.session = Session(cell, serve=here, rate=speed, options=options)
        self.session.__enter__()
        self.result: SessionResult | None = None
        self.thread = threading.Thread(target=self._run)
        server = self.session.server
        assert server is not None
        self.server, self.address = server, server.address
        self.thread.start()

    def _run(self) -> None:
        try:
            self.result = self.session.run()
        finally:
            self.session.__exit__()

    def end(self) -> RunResult:
        self.session.stop.request()
        self.thread.join(TIMEOUT)
        assert isinstance(self.result, RunResult)
        return self.result


@contextmanager
def served(
    cell: Cell, *, lockstep: bool = True, speed: float | None = None, options: RunOptions | None = None
) -> Iterator[ServedCell]:
    home = ServedCell(cell, lockstep=lockstep, speed=speed, options=options or RunOptions(ends_when_done=False))
    try:
        yield home
    finally:
        home.session.stop.request()
        home.thread.join(TIMEOUT)


@contextmanager
def connected(home: ServedCell, *, node: str = "/client", encoding: str = "cdr") -> Iterator[SocketTransport]:
    transport = SocketTransport(home.address, node=node, encoding=encoding)
    try:
        yield transport
    finally:
        transport.close()


def observations(transport: Transport) -> list[object]:
    """Return the observations of a program that does a bit of everything."""
    seen: list[object] = []
    client = Client(transport)
    client.subscribe("/ariac/gripper/state", lambda message: seen.append((transport.now(), message.attached)))
    client.subscribe("/ariac/arm/command", lambda message: seen.append((transport.now(), list(message.joint_names))))
    client.subscribe("/ariac/nothing", seen.append)
    cancel = client.on_sensor("logical_camera_1", lambda message: seen.append((transport.now(), len(message.models))))
    seen.append(client.start_competition())
    order = client.wait_for_order(timeout=1.0)
    assert order is not None
    seen += [order.order_id, client.time]
    client.control_gripper(True)
    seen.append(client.wait_until(lambda: client.gripper_attached, timeout=2.0))
    client.send_arm([[1.5, 0.0, -1.1, 3.1, 3.7, -1.5, 0.0]])
    client.sleep(0.25)
    cancel()
    seen += [client.time, dict(client.joint_positions), client.competition_state]
    seen.append(client.material_locations("gear_part"))
    seen.append(client.control_agv(1, "order_0_kit_0"))
    seen.append(client.wait_until(lambda: client.score > 0, timeout=12.0))
    seen += [client.time, client.score]
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_lockstep_program_observes_and_leaves_state_of_in_process_run(encoding: str) -> None:
    cell = Cell(WHOLE)
    expected = observations(InProcess(cell, node="/client"))
    assert len(expected) > 100
    with served(Cell(WHOLE)) as home, connected(home, encoding=encoding) as transport:
        assert observations(transport) == expected
        assert home.end().state_hash == cell.state_hash()


@pytest.mark.parametrize("others", [0, 1])
def test_lockstep_time_passes_during_long_service_call(others: int) -> None:
    """As in a robot's motion home; another client may wait for time meanwhile."""
    expected = RobotNode(robots.robot(), RobotSettings(sim_time=True))
    away = joint_state(["right_1"], [0.5], time=0)

    def go_home(transport: Transport) -> tuple[Any, int]:
        transport.publish("/io_teleop/joint_cmd", away)
        transport.advance(500_000_000)
        return transport.call("/io_teleop_reset_robot", TriggerRequest()), transport.now()

    answer, time = go_home(InProcess(expected, node="/client"))
    assert (answer.success, time > 600_000_000) == (True, True)
    node = RobotNode(robots.robot(), RobotSettings(sim_time=True))
    with robots.served(node, lockstep=True) as address:
        transport = SocketTransport(address)
        idle = [SocketTransport(address, node=f"/idle{number}") for number in range(others)]
        waiting = [threading.Thread(target=each.advance, args=(time + 100_000_000,)) for each in idle]
        for thread in waiting:
            thread.start()
        found, now = go_home(transport)
        assert found == answer
        assert others or (now, node.simulation.state_hash()) == (time, expected.simulation.state_hash())
        for thread, each in zip(waiting, idle, strict=True):
            thread.join(TIMEOUT)
            each.close()
        transport.close()


def test_passive_subscription_does_not_stop_advance(monkeypatch: pytest.MonkeyPatch) -> None:
    with served(Cell(KITTING)) as home, connected(home) as transport:
        requests: list[int] = []
        ask = transport._connection.ask

        def count(frame: Frame) -> Frame:
            requests.append(frame.kind)
            return ask(frame)

        monkeypatch.setattr(transport._connection, "ask", count)
        times: list[int] = []
        transport.subscribe("/clock", lambda message: times.append(message.clock.nanosec), passive=True)
        transport.advance(200_000_000)
        assert times == list(range(2_000_000, 202_000_000, 2_000_000))
        assert requests.count(FrameKind.ADVANCE) == 1
        transport.subscribe("/ariac/competition_state", times.append)
        transport.advance(400_000_000)
        assert requests.count(FrameKind.ADVANCE) == 1 + 2  # at 0.3 and 0.4 s
        assert len(times) == 202


def test_arm_of_any_model_takes_a_command_before_its_first_joint_states() -> None:
    with served(Cell(ur5_cell())) as home, connected(home) as transport:
        client = Client(transport)
        assert client.move_arm([[1.5, -1.1, 0.0, -2.0, -1.5, 0.0]], [0.5])


def test_socket_errors_match_in_process_errors() -> None:
    for lockstep in (True, False):
        with (
            served(Cell(ARM_ONLY, competition=False), lockstep=lockstep, speed=1.0) as home,
            connected(home) as transport,
        ):
            with pytest.raises(UnknownNameError, match="unknown topic to publish on '/ariac/arm/comand'"):
                transport.publish("/ariac/arm/comand", way(INITIAL))
            with pytest.raises(UnknownNameError, match="unknown service '/ariac/agv1'"):
                transport.call("/ariac/agv1", AGVControlRequest(""))
            with pytest.raises(RejectedCommandError, match="joint"):
                transport.publish("/ariac/arm/command", way(INITIAL, names=("elbow_joint", *["none"] * 6)))
            with pytest.raises(MessageError, match="takes trajectory_msgs/JointTrajectory"):
                transport.publish("/ariac/arm/command", TriggerRequest())
            with pytest.raises(MessageError, match="is not a message"):
                transport.publish("/ariac/arm/command", "go")
            with pytest.raises(ServiceFailedError):
                transport.call("/ariac/submit_tray", SubmitTrayRequest("agv1::kit_tray_1", "kit"))
            with pytest.raises(UsageError, match="absolute"):
                transport.subscribe("clock", print)


def test_time_passes_without_requests_outside_lockstep() -> None:
    with served(Cell(KITTING), lockstep=False, speed=4.0) as home, connected(home) as transport:
        client = Client(transport)
        assert client.start_competition()
        order = client.wait_for_order(timeout=TIMEOUT)
        assert order is not None
        begin = transport.now()
        client.sleep(0.5)
        assert transport.now() - begin >= 500_000_000
        before = transport.now()
        assert client.wait_until(lambda: False, timeout=0.1) is False
        assert transport.now() - before >= 100_000_000


def test_time_without_clock_is_wall_time(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = FakeWallClock()
    monkeypatch.setattr(socket_module, "time", wall)
    with robots.served(RobotNode(robots.robot())) as address:
        transport = SocketTransport(address)
        session = NodeClient(transport)
        joints = session.latest("/io_teleop/joint_states")
        assert joints.wait(timeout=TIMEOUT) is not None
        before, count = transport.now(), joints.count
        wait_until(lambda: joints.count > count, "message during a sleep", between=lambda: session.sleep(0.1))
        assert transport.now() - before >= 100_000_000
        assert not session.wait_until(lambda: False, timeout=0.05)
        assert session.wait_until(lambda: joints.count > count + 40, timeout=TIMEOUT)
        before, wall.ahead = transport.now(), 10**12
        assert transport.now() - before >= 10**12
        assert session.time == pytest.approx(transport.welcome["time"] / 1e9 + 1000.0, abs=TIMEOUT)
        transport.close()


class FakeWallClock:
    """The clock of the machine, which a test can put forward."""

    ahead = 0

    def perf_counter_ns(self) -> int:
        return time.perf_counter_ns() + self.ahead


def test_end_of_run_reaches_waiting_client() -> None:
    cell = Cell(KITTING)
    with served(cell, options=RunOptions(until=0.1)) as home, connected(home) as transport:
        client = Client(transport)
        with pytest.raises(RunEndedError):
            client.sleep(1.0)
        with pytest.raises(RunEndedError):
            client.sleep(1.0)
        assert client.time == pytest.approx(0.1)
        with pytest.raises(RunEndedError):
            client.start_competition()


def test_left_subscription_gets_no_messages() -> None:
    with served(Cell(KITTING)) as home, connected(home) as transport:
        got: list[str] = []
        leave = [transport.subscribe("/clock", lambda _, name=name: got.append(name)) for name in "ab"]  # type: ignore[misc]
        transport.advance(2_000_000)
        leave[0]()
        leave[0]()
        transport.advance(6_000_000)
        assert got == ["a", "b", "b", "b"]
        transport.close()
        with pytest.raises(RunEndedError, match="closed"):
            transport.advance(8_000_000)


def test_cancelling_after_close_sends_nothing() -> None:
    with served(Cell(KITTING)) as home, connected(home) as transport:
        leave = transport.subscribe("/clock", print)
        transport.close()
        leave()


def test_callback_that_closes_client_ends_advance() -> None:
    with served(Cell(KITTING)) as home, connected(home) as transport:
        received: list[str] = []
        transport.subscribe("/clock", lambda _: transport.close())
        transport.subscribe("/ariac/gripper/state", lambda _: received.append("gripper"))
        with pytest.raises(RunEndedError, match="closed"):
            transport.advance(10_000_000)
        assert received == []


def test_close_in_other_thread_ends_wait() -> None:
    with served(Cell(KITTING)) as home, connected(home) as transport, connected(home, node="/other"):
        transport.advance(2_000_000)
        ended: list[BaseException] = []

        def wait() -> None:
            try:
                transport._connection.listen(None)  # for a frame that never comes: in lockstep no client requests time
                transport._connection.listen(None)
            except RunEndedError as error:
                ended.append(error)

        thread = threading.Thread(target=wait, daemon=True)
        thread.start()
        transport.close()
        thread.join(TIMEOUT)
        assert [str(error) for error in ended] == ["the connection was closed"]


def test_lockstep_clients_share_time() -> None:
    with served(Cell(KITTING)) as home, connected(home, node="/one") as one, connected(home, node="/two") as two:
        one.advance(10_000_000)
        two.advance(6_000_000)
        assert two.now() == 10_000_000
        threads = [threading.Thread(target=each.advance, args=(50_000_000,)) for each in (one, two)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(TIMEOUT)
        assert (one.now(), two.now()) == (50_000_000, 50_000_000)
    assert home.result is not None
    assert home.result.steps == 25


def test_connect_accepts_host_and_port_text() -> None:
    with served(Cell(KITTING)) as home:
        host, port = home.address
        client = Client.connect(f"{host}:{port}", node="/operator")
        client.sleep(0.1)
        assert client.time == pytest.approx(0.1)
        client.close()
    with pytest.raises(UsageError, match=f"127.0.0.1:{port}"):
        Client.connect((host, port))


def test_client_of_server_forgets_run_before_reset_and_gets_latched_messages_after_restore() -> None:
    cell = Cell(KITTING)
    taken: list[Any] = []
    with served(cell, lockstep=False, speed=4.0) as home, connected(home) as transport:
        client = Client(transport)
        client.start_competition()
        assert client.wait_for_order(TIMEOUT) is not None
        cell.simulation.inbox.put(lambda: taken.append(cell.snapshot()))
        assert client.wait_until(lambda: bool(taken), TIMEOUT)
        later = taken[0].time + 0.5
        assert client.wait_until(lambda: client.time >= later, TIMEOUT)
        times: list[float] = []  # of each message: the cell may pass that time again before the client looks
        client.subscribe("/ariac/current_score", lambda _: times.append(client.time))
        cell.simulation.inbox.put(lambda: cell.restore(taken[0]))
        assert client.wait_until(lambda: any(time < later for time in times), TIMEOUT)
        assert client.wait_until(lambda: client.competition_state == "go", TIMEOUT)
        assert [each.order_id for each in client.orders] == ["order_0"]
        cell.simulation.inbox.put(cell.reset)
        assert client.wait_until(lambda: client.competition_state == "init", TIMEOUT)
        assert client.orders == []
