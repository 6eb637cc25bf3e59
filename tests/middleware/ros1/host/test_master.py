"""Client of a master, with servers that answer, hang or send nonsense."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from cellwright.middleware.ros1.host.master import MasterClient, MasterError
from cellwright.util.errors import UsageError
from tests.support.ports import free_port
from tests.support.waiting import TIMEOUT

MASTER_TIMEOUT = 0.5
is_over = threading.Event()
"""Ends the server that drips."""


class FakeMaster:
    """Fake of the part of a master's API that is used; it records its calls."""

    def __init__(self) -> None:
        self.parameters: dict[str, Any] = {}
        self.nodes: dict[str, str] = {}
        self.server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self.server.register_function(lambda caller: [1, "", 42], "getPid")
        self.server.register_function(self.set_param, "setParam")
        self.server.register_function(self.get_param, "getParam")
        self.server.register_function(
            lambda caller: [1, "", [[["/states", sorted(self.nodes)]], [], []]], "getSystemState"
        )
        self.server.register_function(self.look_up, "lookupNode")

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.server.server_address[1]}"

    def set_param(self, caller: Any, name: Any, value: Any) -> list[Any]:
        assert caller == "/cellwright"
        self.parameters[name] = value
        return [1, "", 0]

    def get_param(self, caller: Any, name: Any) -> list[Any]:
        if name in self.parameters:
            return [1, "", self.parameters[name]]
        return [-1, f"Parameter [{name}] is not set", 0]

    def look_up(self, caller: Any, name: Any) -> list[Any]:
        if name in self.nodes:
            return [1, "", self.nodes[name]]
        return [-1, f"unknown node [{name}]", ""]


@pytest.fixture
def fake() -> Iterator[FakeMaster]:
    made = FakeMaster()
    thread = threading.Thread(target=made.server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield made
    made.server.shutdown()
    thread.join()
    made.server.server_close()


@contextmanager
def answering(talk: Callable[[socket.socket], None]) -> Iterator[str]:
    """Run a server that is no master; yield its address."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            while True:
                try:
                    connection, _ = listener.accept()
                except OSError:
                    return
                with connection:
                    talk(connection)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        listener.shutdown(socket.SHUT_RDWR)
        thread.join(TIMEOUT)


@pytest.mark.parametrize(
    "uri", ["", "localhost", "localhost:11311", "http://", "http://a", "https://a:1", "http://a:x"]
)
def test_invalid_master_uri_is_refused(uri: str) -> None:
    with pytest.raises(UsageError, match="not an address like http://localhost:11311"):
        MasterClient(uri)


def test_is_local_recognizes_addresses_of_this_machine() -> None:
    for host in ("localhost", "127.0.0.1", "127.1.2.3", "[::1]", socket.gethostname()):
        assert MasterClient(f"http://{host}:11311/").is_local
    assert not MasterClient("http://192.0.2.1:11311").is_local


def test_master_client_answers_and_sets_parameters(fake: FakeMaster) -> None:
    master = MasterClient(fake.uri + "/")
    assert master.answers()
    assert master.is_port_taken()
    assert master.living_node("/gazebo") is None
    fake.nodes["/gazebo"] = fake.uri
    assert master.living_node("/gazebo") == fake.uri
    fake.nodes["/gazebo"] = f"http://127.0.0.1:{free_port()}"  # it was killed, and the master does not know
    assert master.living_node("/gazebo") is None


def test_set_parameters_keeps_parameters_beside_them(fake: FakeMaster) -> None:
    MasterClient(fake.uri).set_parameters({"use_sim_time": True, "ariac": {"arm": {"gains": {"p": 1.0}}, "text": "x"}})
    assert fake.parameters == {"/use_sim_time": True, "/ariac/arm": {"gains": {"p": 1.0}}, "/ariac/text": "x"}


def test_unset_parameter_is_none(fake: FakeMaster) -> None:
    master = MasterClient(fake.uri)
    assert master.parameter("/x") is None
    master.set_parameter("/x", 0)
    assert master.parameter("/x") == 0


def test_living_publishers_omits_dead_nodes(fake: FakeMaster) -> None:
    fake.nodes = {"/alive": fake.uri, "/dead": f"http://127.0.0.1:{free_port()}"}
    assert MasterClient(fake.uri).living_publishers("/states") == ["/alive"]
    assert MasterClient(fake.uri).living_publishers("/others") == []


def test_master_client_without_master_raises_master_error() -> None:
    master = MasterClient(f"http://127.0.0.1:{free_port()}", MASTER_TIMEOUT)
    assert not master.answers()
    assert not master.is_port_taken()
    with pytest.raises(MasterError, match="gave no answer"):
        master.set_parameter("/x", 1)
    with pytest.raises(MasterError, match="gave no answer"):
        master.living_node("/gazebo")


def hang(connection: socket.socket) -> None:
    connection.settimeout(TIMEOUT)
    while connection.recv(1000):
        pass


def drip(connection: socket.socket) -> None:
    """Answer slowly and without end: no single read lasts long, and a line never ends."""
    with suppress(OSError):
        while not is_over.wait(MASTER_TIMEOUT / 20):
            connection.sendall(b"H")


def say(text: bytes) -> Callable[[socket.socket], None]:
    def talk(connection: socket.socket) -> None:
        connection.recv(1000)
        connection.sendall(text)

    return talk


def xml(value: str) -> Callable[[socket.socket], None]:
    body = f"<methodResponse><params><param><value>{value}</value></param></params></methodResponse>"
    head = f"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
    return say((head + body).encode())


@pytest.mark.parametrize(
    "talk",
    [
        hang,
        drip,
        say(b""),
        say(b"\x00\xff\r\n\r\n"),
        say(b"HTTP/1.0 404 Not Found\r\n\r\n"),
        say(b"HTTP/1.0 200 OK\r\n\r\n<methodResponse><params><par"),
        xml("<int>3</int>"),
        xml("<array><data><value><string>a</string></value></data></array>"),
        xml("<array><data><value><i4>-1</i4></value><value>no</value><value>0</value></data></array>"),
    ],
    ids=["hangs", "drips", "closes", "noise", "404", "half", "number", "short", "refuses"],
)
def test_other_server_is_no_master_within_timeout(talk: Callable[[socket.socket], None]) -> None:
    with answering(talk) as uri:
        is_over.clear()
        master = MasterClient(uri, MASTER_TIMEOUT)
        assert not master.answers()  # the server that drips would block it forever
        is_over.set()
        assert master.is_port_taken()


def test_unresolvable_master_host_fails_within_timeout(monkeypatch: pytest.MonkeyPatch) -> None:
    ready = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_more: ready.wait(TIMEOUT))
    assert not MasterClient("http://far.away:11311", MASTER_TIMEOUT).answers()
    assert not ready.is_set()
    assert [thread.name for thread in threading.enumerate() if thread.name == "ros-master"], "it looks it up still"
    ready.set()
