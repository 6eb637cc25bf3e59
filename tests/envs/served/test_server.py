"""Server of an environment: one client at a time, hostile peers, its end."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import closing
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from cellwright import load_trial
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack, unpack
from cellwright.envs.served import server as module
from cellwright.envs.served.protocol import MAX_REQUEST
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from cellwright.util.errors import UsageError
from tests.support.waiting import TIMEOUT


@pytest.fixture(name="server")
def made_server() -> Iterator[EnvServer]:
    with closing(EnvServer(EnvSession(load_trial("pick_from_bin")))) as server:
        yield server


def connected(server: EnvServer) -> ClientConnection:
    return connect(server.address, proxy=None, compression=None, max_size=None, ping_interval=None)


def ask(connection: Connection, kind: str, **fields: Any) -> dict[str, Any]:
    connection.send(pack({"type": kind, **fields}, OPENPI))
    return read(connection)


def read(connection: Connection) -> dict[str, Any]:
    frame = connection.recv(TIMEOUT)
    assert isinstance(frame, bytes)
    reply = unpack(frame, OPENPI)
    assert isinstance(reply, dict)
    return reply


def test_an_episode_over_the_socket(server: EnvServer) -> None:
    with connected(server) as client:
        assert ask(client, "hello")["task"] == "pick_from_bin"
        action = ask(client, "reset", seed=1)["observation"]["agent_pos"]
        assert ask(client, "step", action=action)["info"]["time"] == 0.05
        assert ask(client, "close") == {"type": "close"}
        with pytest.raises(ConnectionClosed):
            client.recv(TIMEOUT)


def test_a_second_client_is_refused_in_words_and_comes_later(
    server: EnvServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_PATIENCE", 0.05)
    with connected(server) as first:
        assert ask(first, "hello")["type"] == "hello"
        with connected(server) as second:
            refusal = read(second)
            assert (refusal["type"], refusal["kind"]) == ("error", "busy")
            assert refusal["error"] == "another client is connected; start a server for each"
            with pytest.raises(ConnectionClosed) as closed:
                second.recv(TIMEOUT)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1013
        assert ask(first, "reset", seed=1)["type"] == "reset"
    monkeypatch.setattr(module, "_PATIENCE", TIMEOUT)
    with connected(server) as third:
        assert "send reset first" in ask(third, "step", action=[0.0] * 8)["error"]


def test_hostile_frames_are_answered_and_the_client_goes_on(server: EnvServer) -> None:
    with connected(server) as client:
        for frame in ("text", b"", b"\xc1", b"\x81\xa4type", b"\xdd\xff\xff\xff\xff", b"\x91" * 5000, bytes(1000)):
            client.send(frame)
            assert (reply := read(client))["type"] == "error", reply
        assert ask(client, "hello")["type"] == "hello"


def test_a_frame_that_is_too_large_ends_the_connection_alone(server: EnvServer) -> None:
    with connected(server) as client:
        client.send(bytes(MAX_REQUEST + 1))
        with pytest.raises(ConnectionClosed) as closed:
            client.recv(TIMEOUT)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1009
    with connected(server) as client:
        assert ask(client, "hello")["type"] == "hello"


def test_peers_that_are_no_clients_disturb_no_client(server: EnvServer, capfd: pytest.CaptureFixture[str]) -> None:
    at = urlsplit(server.address)
    with socket.create_connection((at.hostname or "", at.port or 0), TIMEOUT) as raw:
        raw.sendall(b"\x00\xff" * 100 + b"\r\n\r\n")
        while raw.recv(4096):  # until the server ends it
            pass
    with pytest.raises(InvalidStatus):  # a page in a browser
        connect(server.address, proxy=None, origin="http://example.org")  # type: ignore[arg-type]  # text is one
    with connected(server) as client:
        assert ask(client, "hello")["type"] == "hello"
    assert capfd.readouterr() == ("", "")


def test_a_defect_is_reported_and_ends_the_connection_alone(
    server: EnvServer, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(_session: EnvSession, _frame: Any) -> Any:
        raise ZeroDivisionError

    with monkeypatch.context() as patched:
        patched.setattr(EnvSession, "reply", broken)
        with connected(server) as client, pytest.raises(ConnectionClosed):
            ask(client, "hello")
    assert "ZeroDivisionError" in capfd.readouterr().err
    with connected(server) as client:
        assert ask(client, "hello")["type"] == "hello"


def test_the_end_of_the_server_ends_its_connection() -> None:
    server = EnvServer(EnvSession(load_trial("pick_from_bin")))
    was_running = server.is_running
    with connected(server) as client:
        assert ask(client, "hello")["type"] == "hello"
        server.close()
        with pytest.raises(ConnectionClosed):
            client.recv(TIMEOUT)
    assert was_running
    assert not server.is_running
    with pytest.raises(OSError, match="refused"):
        connected(server)


def test_a_port_in_use_is_refused(server: EnvServer) -> None:
    port = urlsplit(server.address).port
    assert port
    with closing(EnvSession(load_trial("pick_from_bin"))) as other:
        with pytest.raises(UsageError, match=rf"127.0.0.1:{port}: cannot listen there \(.*; choose another port"):
            EnvServer(other, port=port)
        with pytest.raises(UsageError, match=r"no-such-host\.invalid:0: cannot listen there"):
            EnvServer(other, "no-such-host.invalid")
