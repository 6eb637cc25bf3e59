"""Limits of the server: numbers of clients and requests, sizes of messages, and the time that they take."""

from __future__ import annotations

import contextlib
import socket
import struct

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.middleware.server import clients as clients_module
from cellwright.middleware.server import server as server_module
from cellwright.middleware.server.clients import FULL, MAX_CLIENTS
from cellwright.middleware.server.requests import MAX_PENDING_ADVANCES, MAX_SUBSCRIPTIONS
from cellwright.middleware.wire.frames import (
    MAX_CLIENT_FRAME_BYTES,
    MAX_FRAME_BYTES,
    Decoder,
    Frame,
    FrameKind,
    advance,
)
from tests.middleware.server.talk import served
from tests.middleware.server.test_hostile_clients import is_answered
from tests.support.cells import ARM_ONLY, INITIAL, KITTING, way
from tests.support.waiting import TIMEOUT


def test_number_of_clients_and_subscriptions_is_limited() -> None:
    with served(Cell(KITTING)) as hall:
        client = hall.connect()
        for number in range(1, MAX_SUBSCRIPTIONS + 1):
            client.say(Frame(FrameKind.SUBSCRIBE, number, f"/nothing_{number}"))
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 77_777, "/clock")).name == "UsageError"
        crowd: list[socket.socket] = []
        while len(crowd) < MAX_CLIENTS:
            crowd.append(socket.create_connection(hall.server.address))
            hall.server.wait(0.0)
        client.wait_until(lambda: len(hall.server._clients) == MAX_CLIENTS)
        crowd[0].settimeout(TIMEOUT)
        (answer,) = Decoder().feed(crowd[0].recv(4096))  # the one that has been silent for longest makes room
        assert f"{MAX_CLIENTS} clients" in answer.text()
        assert is_answered(hall.connect("/late"))
        client.heard.clear()
        assert is_answered(client)
        for connection in crowd:
            connection.close()


def test_advance_requests_are_limited_and_end_with_client() -> None:
    with served(Cell(KITTING), lockstep=True) as hall:
        client, other = hall.connect(), hall.connect("/other")
        other.say(advance(1, 10**9, each_tick=False))
        other.wait_until(lambda: hall.server.advance_request is not None)
        requests = [advance(number, 10**12, each_tick=False) for number in range(1, 1001)]
        client.say(*requests)
        client.wait_until(lambda: len(client.heard) == 1000 - MAX_PENDING_ADVANCES)
        assert {frame.name for frame in client.heard} == {"UsageError"}
        assert f"at most {MAX_PENDING_ADVANCES} pending" in client.heard[0].text()
        assert len(hall.server._requests.pending) == MAX_PENDING_ADVANCES + 1
        client.connection.close()
        other.wait_until(lambda: len(hall.server._requests.pending) == 1)  # though it was not its turn yet


def test_incomplete_frames_of_all_clients_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "MAX_INCOMPLETE", 2 << 20)
    with served(Cell(KITTING)) as hall:
        other = hall.connect("/other")
        half = struct.pack("<I", MAX_CLIENT_FRAME_BYTES) + bytes(MAX_CLIENT_FRAME_BYTES // 2)
        others = [hall.connect(f"/half_{number}") for number in range(3)]
        for client in others:
            rest = memoryview(half)
            client.connection.setblocking(False)
            while rest and not client.is_over:
                with contextlib.suppress(BlockingIOError, ConnectionError):
                    rest = rest[client.connection.send(rest) :]
                hall.server.wait(0.0)
                client.listen()
        other.wait_until(lambda: sum(client.incomplete_bytes for client in hall.server._clients) <= 2 << 20)
        other.wait_until(lambda: len(hall.server.clients) < 4)
        assert "/other" in hall.server.clients
        assert is_answered(other)


def test_clients_share_limit_of_waiting_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "MAX_WAITING", 2 * FULL)
    with served(Cell(KITTING)) as hall:
        clients = [hall.connect(f"/guest_{number}") for number in range(4)]
        assert [client.full for client in hall.server._clients] == [FULL // 2] * 4
        for client in clients[1:]:
            client.connection.close()
        clients[0].wait_until(lambda: len(hall.server.clients) == 1)
        assert [client.full for client in hall.server._clients] == [FULL]


def test_message_too_long_to_send_is_reported_and_step_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients_module, "_CHECK_PERIOD", 0.0)
    cell = Cell(KITTING)
    huge = cell.bus.advertise("/huge", "std_msgs/String")
    with served(cell) as hall:
        client = hall.connect()
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/huge"))
        message = String("x" * (MAX_FRAME_BYTES + 1))
        for _ in range(3):
            huge.publish(message)
        hall.server.wait(0.0)
        (line,) = hall.lines
        assert line.startswith(f"cannot send to /me: a frame of {MAX_FRAME_BYTES + 21} bytes is too long")
        assert line.endswith("(and 2 more since the last report)")
        huge.publish(String("small"))
        client.wait_until(lambda: len(client.messages(5)) == 1)


def test_heavy_requests_leave_time_for_other_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between two such commands others have their turn, also those who come later."""
    monkeypatch.setattr(server_module, "_HEAVY_TIME", 0.0)
    monkeypatch.setattr(server_module, "_HEAVY_PAUSE", 1e9)
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        greedy, other = hall.connect("/greedy"), hall.connect("/other")
        monkeypatch.setattr(server_module, "_HEAVY_TIME", 1e-9)
        hall.server._rests_until = 0.0
        for client in hall.server._clients:
            client.is_heavy = False
        data = TYPES.to_cdr(way(INITIAL))
        greedy.say(*[Frame(FrameKind.PUBLISH, number, "/ariac/arm/command", payload=data) for number in range(1, 50)])
        greedy.wait_until(lambda: len(greedy.heard) == 1)
        monkeypatch.setattr(server_module, "_HEAVY_TIME", 1e9)
        for _ in range(20):
            assert is_answered(other)
            greedy.listen()
        assert len(greedy.heard) == 1
        looks, look = 0, hall.server._look_at_sockets

        def count(seconds: float) -> bool:
            nonlocal looks
            looks += 1
            return look(seconds)

        with monkeypatch.context() as counted:
            counted.setattr(hall.server, "_look_at_sockets", count)
            hall.server.wait(0.2)
        assert looks < 10  # it waits, and does not check them again and again
        hall.server._rests_until = 0.0
        greedy.wait_until(lambda: len(greedy.heard) == 49)
