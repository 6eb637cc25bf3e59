"""Two sets of types in one process: each bus, server, client and recording reads the fields of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.messages import TypeSet
from cellwright.middleware.messages.message_class import MessageClass, message_class
from cellwright.middleware.server import Server
from cellwright.recording.format.format import METADATA, RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import MessageError, UsageError
from tests.support.waiting import TIMEOUT


class First:
    """Messages of a first generation."""

    @message_class("osrf_gear/msg/Box")
    class Box(MessageClass):
        """Box with a type."""

        kind: str = ""

    @message_class("osrf_gear/srv/Ship_Request")
    class ShipRequest(MessageClass):
        """Request to ship by name."""

        name: str = ""

    @message_class("osrf_gear/srv/Ship_Response")
    class ShipResponse(MessageClass):
        """Response."""

        success: bool = False


class Second:
    """Messages of a second generation: the same names, other fields."""

    @message_class("osrf_gear/msg/Box")
    class Box(MessageClass):
        """Box with a mass [kg] before its type."""

        mass: float = 0.0
        kind: str = ""
        sizes: Any = ()

    @message_class("osrf_gear/srv/Ship_Request")
    class ShipRequest(MessageClass):
        """Request to ship by number."""

        number: int = 0

    @message_class("osrf_gear/srv/Ship_Response")
    class ShipResponse(MessageClass):
        """Response."""

        success: bool = False
        reason: str = ""


def _type_set(folder: Path, classes: type, box: str, ship: str) -> TypeSet:
    for namespace, name, text in (("msg", "Box", box), ("srv", "Ship", ship)):
        file = folder / "osrf_gear" / namespace / f"{name}.{namespace}"
        file.parent.mkdir(parents=True)
        file.write_text(text)
    return TypeSet(folder, [classes])


@pytest.fixture
def first(tmp_path: Path) -> TypeSet:
    """First generation."""
    return _type_set(tmp_path / "first", First, "string kind\n", "string name\n---\nbool success\n")


@pytest.fixture
def second(tmp_path: Path) -> TypeSet:
    """Second generation."""
    box = "float64 mass\nstring kind\nfloat32[] sizes\n"
    return _type_set(tmp_path / "second", Second, box, "uint8 number\n---\nbool success\nstring reason\n")


class _Depot:
    """Node that publishes a box, takes boxes and ships them, with the messages of its set; served in a thread."""

    name = "depot"
    in_competition = False

    def __init__(self, types: TypeSet, box: Any, response: object) -> None:
        self.simulation = Simulation(mujoco.MjSpec().compile())
        self.bus = Bus(lambda: self.simulation.now, types=types)
        self.received: list[Any] = []
        self.bus.advertise("/box", "osrf_gear/Box", latch=True).publish(box)
        self.bus.listen("/boxes", "osrf_gear/Box", lambda message, _node: self.received.append(message))

        def ship(request: Any, _node: str) -> object:
            self.received.append(request)
            return response

        self.bus.serve("/ship", "osrf_gear/Ship", ship)

    @contextmanager
    def served(self) -> Iterator[tuple[str, int]]:
        server, is_over = Server(self, port=0), Event()

        def serve() -> None:
            while not is_over.is_set():
                server.wait(0.01)

        thread = Thread(target=serve)
        thread.start()
        try:
            yield server.address
        finally:
            is_over.set()
            thread.join(TIMEOUT)
            server.close("over")


def test_one_name_has_two_checksums_and_definitions(first: TypeSet, second: TypeSet) -> None:
    assert first.md5("osrf_gear/Box") != second.md5("osrf_gear/Box")
    assert first.md5("osrf_gear/Ship") != second.md5("osrf_gear/Ship")
    assert "mass" in second.definition("osrf_gear/Box")
    assert "mass" not in first.definition("osrf_gear/Box")


def test_message_of_other_set_is_refused(first: TypeSet, second: TypeSet) -> None:
    bus = Bus(lambda: 0, types=first)
    bus.listen("/boxes", "osrf_gear/Box", lambda _message, _node: None)
    with pytest.raises(MessageError, match="takes osrf_gear/Box"):
        bus.publish("/boxes", Second.Box(1.0))
    with pytest.raises(MessageError, match="must be of type osrf_gear/Box"):
        first.checked(Second.Box(1.0))
    with pytest.raises(UsageError, match="not the class of osrf_gear/msg/Box"):
        second.from_cdr(second.to_cdr(second.checked(Second.Box(1.0, "a"))), First.Box)


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_two_servers_in_one_process_serve_each_its_own_set(first: TypeSet, second: TypeSet, encoding: str) -> None:
    shown = First.Box("gear"), Second.Box(2.5, "gear", np.array([1, 2], np.float32))
    sent = First.Box("disk"), second.checked(Second.Box(0.5, "disk", [0.25]))
    requests = First.ShipRequest("kit"), Second.ShipRequest(7)
    responses = First.ShipResponse(success=True), Second.ShipResponse(reason="full")
    depots = [_Depot(types, *each) for types, *each in zip((first, second), shown, responses, strict=True)]
    with ExitStack() as stack:
        clients = []
        for depot in depots:
            address = stack.enter_context(depot.served())
            clients.append(SocketTransport(address, encoding=encoding, types=depot.bus.types))
            stack.callback(clients[-1].close)
        for number, (client, depot) in enumerate(zip(clients, depots, strict=True)):
            write, boxes = depot.bus.types.encodings[encoding].write, list[Any]()
            client.subscribe("/box", boxes.append)
            client.advance(None, lambda: bool(boxes))  # noqa: B023, called in this round
            assert write(boxes[0]) == write(shown[number])
            client.publish("/boxes", sent[number])
            assert client.call("/ship", requests[number]) == responses[number]
            assert write(depot.received[0]) == write(sent[number])
            assert depot.received[1] == requests[number]


def test_two_recordings_in_one_process_have_each_its_own_set(tmp_path: Path, first: TypeSet, second: TypeSet) -> None:
    topic = RecordedTopic("/box", "osrf_gear/Box", "out", "on event")
    for types, box in ((first, First.Box("gear")), (second, Second.Box(2.5, "gear", np.zeros(0, np.float32)))):
        path = tmp_path / "box.mcap"
        with McapFile(path, types=types) as file:
            file.describe(METADATA, RecordingHeader("cell", "small", {}).metadata())
            file.add(file.channel(topic), 0, types.to_cdr(box))
        with RecordingFile(path, types=types) as recording:
            (decoded,) = map(recording.decode, recording.messages(["/box"]))
        assert type(decoded) is type(box)
        assert types.to_cdr(decoded) == types.to_cdr(box)
