"""Clients that misbehave: they lose their connection, and others lose nothing."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.server import clients as clients_module
from cellwright.middleware.server import server as server_module
from cellwright.middleware.server.clients import BEHIND, FULL, MAX_HELLO_BYTES, ClientConnection
from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES, Frame, FrameKind, hello
from tests.middleware.server.talk import Hall, Talker, as_json, served
from tests.support.cells import ARM_ONLY, INITIAL, KITTING, start, way
from tests.support.waiting import wait_until


def is_answered(client: Talker) -> bool:
    """True if a client still gets answers."""
    return client.call("/ariac/material_locations", TriggerRequest()).kind is FrameKind.REFUSED


def send_invalid(hall: Hall, data: bytes) -> Talker:
    """Return a client that sent bytes before its HELLO, once the server has disconnected it."""
    client = hall.connect(node="")
    client.connection.sendall(data)
    client.wait_until(lambda: client.is_over)
    return client


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", "invalid frame length"),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(100), "invalid frame length"),  # TLS
        (b"SSH-2.0-OpenSSH_9.2p1\r\n", "invalid frame length"),
        (struct.pack("<I", MAX_HELLO_BYTES + 1), "invalid frame length"),
        (hello("/a", "cdr").encode() + struct.pack("<I", MAX_CLIENT_FRAME_BYTES + 1), "invalid frame length"),
        (struct.pack("<I", 1 << 31) + b"x" * 40, "invalid frame length"),
        (Frame(FrameKind.SUBSCRIBE, 1, "/clock").encode(), "must be HELLO"),
        (Frame(FrameKind.WELCOME).encode(), "must be HELLO"),
        (Frame(FrameKind.HELLO, payload=b"[]").encode(), "not a JSON object"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=9, node="/a", encoding="cdr")).encode(), "uses protocol 1"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=1, node="a", encoding="cdr")).encode(), "like '/robot'"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=1, node="/a\nb", encoding="cdr")).encode(), "like '/robot'"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=1, node=["/a"], encoding="cdr")).encode(), "like '/robot'"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=1, node="/a", encoding="xml")).encode(), "cdr or ros1"),
        (Frame(FrameKind.HELLO, payload=as_json(protocol=1, node="/a", encoding={})).encode(), "cdr or ros1"),
        (hello("/a", "cdr").encode() * 2, "a client cannot send HELLO again"),
        (hello("/a", "cdr").encode() + Frame(FrameKind.MESSAGE, 1).encode(), "a client cannot send MESSAGE"),
        (
            hello("/a", "cdr").encode() + Frame(FrameKind.ADVANCE, 1, payload=b"x").encode(),
            "invalid payload of ADVANCE",
        ),
    ],
)
def test_invalid_bytes_are_refused_and_disconnect_client(data: bytes, reason: str) -> None:
    with served(Cell(KITTING)) as hall:
        other = hall.connect("/other")
        client = send_invalid(hall, data)
        last = client.heard[-1]
        assert (last.kind, last.number) == (FrameKind.REFUSED, 0)
        assert reason in last.text()
        assert is_answered(other)
        assert hall.server.clients == ("/other",)


class FakeClock:
    """Clock for the reports about clients, which the test moves."""

    def __init__(self) -> None:
        self.time = 0.0

    def monotonic(self) -> float:
        return self.time


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    made = FakeClock()
    monkeypatch.setattr(clients_module, "time", made)
    return made


def test_disconnected_clients_are_reported_once_a_second(clock: FakeClock) -> None:
    with served(Cell(KITTING)) as hall:
        for _ in range(20):
            send_invalid(hall, b"rubbish " * 4)
        clock.time = 0.99
        hall.server.wait(0.0)
        assert hall.lines == []
        clock.time = 1.0
        hall.server.wait(0.0)
        (line,) = hall.lines
        assert line.startswith("disconnected a connection from 127.0.0.1: invalid frame length: ")
        assert line.endswith("(and 19 more since the last report)")
        send_invalid(hall, b"rubbish " * 4)
        hall.server.close("over")
        assert len(hall.lines) == 2


@pytest.fixture(scope="module")
def hall() -> object:
    cell = Cell(KITTING)
    with served(cell) as hall:
        hall.connect("/other")
        yield hall


pieces = st.one_of(
    st.binary(max_size=80),
    st.builds(
        lambda kind, number, name, payload: Frame(kind, number, name, payload=payload).encode(),
        st.sampled_from(FrameKind),
        st.integers(0, 2**32 - 1),
        st.sampled_from(["", "/clock", "/ariac/agv1", "/ariac/orders", "\0", "/ariac/end_competition"]),
        st.one_of(st.binary(max_size=40), st.just(TYPES.to_cdr(TriggerRequest()))),
    ),
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(st.booleans(), st.lists(pieces, max_size=6))
def test_random_bytes_do_not_stop_server(hall: Hall, is_greeted: bool, data: list[bytes]) -> None:
    with socket.create_connection(hall.server.address) as connection:
        connection.sendall((hello("/rude", "cdr").encode() if is_greeted else b"") + b"".join(data))
        for _ in range(3):
            hall.server.wait(0.001)
    assert is_answered(hall.clients[0])


@pytest.mark.parametrize("name", ["robot", "/a\nb", "/a\x1b[2J"])
def test_publish_with_invalid_node_name_is_refused(name: str) -> None:
    with served(Cell(ARM_ONLY)) as hall:
        answer = hall.connect().publish("/ariac/arm/command", way(), node=name)
        assert answer.kind is FrameKind.REFUSED
        assert b"a node name must look like '/robot'" in answer.payload


@pytest.mark.slow
def test_flood_of_commands_uses_idle_time_only() -> None:
    """20 commands a tick, 10,000 a second: each is answered, and the ticks pass meanwhile."""
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        client, count, burst = hall.connect(), 2_000, 20
        data = TYPES.to_cdr(way(INITIAL))
        frames = [
            Frame(FrameKind.PUBLISH, number, "/ariac/arm/command", payload=data) for number in range(1, count + 1)
        ]
        loop = SimulationLoop(cell.simulation, hall.server)
        for sent in range(0, count, burst):
            client.say(*frames[sent : sent + burst])
            assert loop.tick()
            # the client runs in this thread: far ahead of a slow server, it would wait for itself
            client.wait_until(lambda sent=sent: len(client.heard) > sent - 1000)  # type: ignore[misc]
        assert cell.simulation.clock.tick == count // burst
        client.wait_until(lambda: len(client.heard) == count)
        assert {frame.kind for frame in client.heard} == {FrameKind.DONE}
        assert [frame.number for frame in client.heard] == list(range(1, count + 1))


def test_server_checks_time_between_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        client, other = hall.connect(), hall.connect("/other")
        data = Frame(FrameKind.PUBLISH, 0, "/ariac/arm/command", payload=TYPES.to_cdr(way(*[INITIAL] * 100))).encode()
        client.connection.setblocking(False)
        try:
            while True:
                client.connection.send(data)
        except BlockingIOError:
            client.connection.setblocking(True)
        done, carry_out = 0, hall.server._requests.carry_out

        def take_a_millisecond(speaker: ClientConnection, frame: Frame) -> None:
            nonlocal done
            done += 1
            carry_out(speaker, frame)

        monkeypatch.setattr(hall.server._requests, "carry_out", take_a_millisecond)
        # a clock on which each command takes a millisecond on any machine
        now, monotonic = time.perf_counter, time.monotonic  # noqa: TID251 - the clock that is put forward
        late = SimpleNamespace(perf_counter=lambda: now() + done * 0.001, monotonic=monotonic)
        monkeypatch.setattr(server_module, "time", late)
        for turn in range(1, 6):
            hall.server.wait(0.005)
            assert done <= 5 * turn
        assert done > 0
        assert is_answered(other)  # others have their turn meanwhile


def subscribe_often(hall: Hall, deaf: Talker, other: Talker) -> None:
    """Subscribe to the joint states 800 times for a client that does not read the answers."""
    deaf.say(*[Frame(FrameKind.SUBSCRIBE, 1000 + number, "/ariac/joint_states") for number in range(800)])
    other.wait_until(
        lambda: [len(client.subscriptions) for client in hall.server._clients if client.node == "/deaf"] == [800]
    )


@pytest.mark.slow
def test_client_that_never_reads_loses_its_messages_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "_CHECK_PERIOD", 0.0)
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        deaf, other = hall.connect("/deaf"), hall.connect("/other")
        other.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock"))
        deaf.connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        subscribe_often(hall, deaf, other)
        ticks = 0
        while not hall.lines and ticks < 2000:
            cell.step()
            hall.server.wait(0.0)
            other.listen()
            ticks += 1
        assert hall.lines[0].startswith("client /deaf is too slow: ")
        assert sum(client.has_waiting for client in hall.server._clients) == 1
        assert all(len(client._out) < FULL + BEHIND for client in hall.server._clients)
        assert hall.server.is_client_behind
        other.wait_until(lambda: len(other.messages(5)) == ticks)


def test_stuck_client_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "_CHECK_PERIOD", 0.0)
    monkeypatch.setattr(clients_module, "SLOW_CLIENT_TIMEOUT", 0.05)
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        deaf, other = hall.connect("/deaf"), hall.connect("/other")
        deaf.connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        subscribe_often(hall, deaf, other)

        def step() -> None:
            cell.step()
            hall.server.wait(0.0)

        wait_until(lambda: hall.server.clients == ("/other",), "end of the deaf client", between=step)
        assert any(line.startswith("disconnected /deaf: it read nothing for") for line in hall.lines)
        assert is_answered(other)


@pytest.mark.slow
def test_client_that_never_reads_answers_is_not_read() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        deaf = hall.connect("/deaf")
        question = Frame(FrameKind.CALL, 1, "/no/such/service/" + "x" * 2000).encode()
        deaf.connection.setblocking(False)
        (client,) = hall.server._clients
        rest = b""

        def ask_more() -> None:
            nonlocal rest
            rest = rest or question * 20
            with contextlib.suppress(BlockingIOError):
                rest = rest[deaf.connection.send(rest) :]
            hall.server.wait(0.001)

        wait_until(lambda: client.is_behind, "client that is behind", between=ask_more)
        for _ in range(50):
            ask_more()
        assert BEHIND <= len(client._out) < FULL


def test_client_without_hello_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "_CHECK_PERIOD", 0.0)
    monkeypatch.setattr(clients_module, "SLOW_CLIENT_TIMEOUT", 0.05)
    with served(Cell(KITTING)) as hall:
        client = hall.connect(node="")
        client.wait_until(lambda: client.is_over)
        assert "no HELLO" in client.heard[-1].text()


def test_call_of_client_that_dies_takes_effect() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        client, other = hall.connect(), hall.connect("/other")
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock"))
        call = Frame(FrameKind.CALL, 1, "/ariac/agv1", payload=TYPES.to_cdr(AGVControlRequest("")))
        client.say(call)
        client.connection.sendall(call.encode()[:-3])  # and half of another one
        client.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.connection.close()
        other.wait_until(lambda: hall.server.clients == ("/other",))
        for _ in range(5):
            cell.step()
            hall.server.wait(0.0)
        assert cell.bus.topic("/clock").subscribers == ()


def test_client_that_dies_in_lockstep_leaves_no_request() -> None:
    with served(Cell(KITTING), lockstep=True) as hall:
        client = hall.connect()
        client.say(Frame(FrameKind.ADVANCE, 1, payload=struct.pack("<qB", 10**12, 0)))
        asked = wait_until(
            lambda: hall.server.advance_request, "question for time", between=lambda: hall.server.wait(0.01)
        )
        assert asked is not None
        assert asked.until == 10**12
        client.connection.close()
        wait_until(
            lambda: hall.server.advance_request is None, "end of the question", between=lambda: hall.server.wait(0.01)
        )


def test_subscriptions_to_all_topics_leave_state_hash_unchanged() -> None:
    hashes = set()
    for is_watched in (False, True):
        cell = Cell(KITTING)
        with served(cell) as hall:
            if is_watched:
                for encoding in ("cdr", "ros1"):
                    client = hall.connect(f"/{encoding}", encoding)
                    for number, info in enumerate(cell.bus.topics(), start=1):
                        client.ask(Frame(FrameKind.SUBSCRIBE, number, info.name))
            start(cell)
            for _ in range(500):
                cell.step()
                hall.server.wait(0.0)
                for client in hall.clients:
                    client.listen()
            assert all(len(client.heard) > 500 for client in hall.clients)
        hashes.add(cell.state_hash())
    assert len(hashes) == 1


def test_report_of_many_disconnected_clients_names_some(clock: FakeClock) -> None:
    with served(Cell(KITTING)) as hall:
        for number in range(30):
            send_invalid(hall, hello(f"/rude_{number}", "cdr").encode() + b"rubbish " * 4)
        clock.time = 1.0
        hall.server.wait(0.0)
        assert len(hall.lines) == 11
        assert hall.lines[-1].startswith("disconnected others: invalid frame length")
        assert hall.lines[-1].endswith("(and 19 more since the last report)")
