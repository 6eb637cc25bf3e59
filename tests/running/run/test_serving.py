"""Tests of a session that serves clients."""

from __future__ import annotations

import threading
from contextlib import ExitStack

import pytest

import cellwright
from cellwright.cell.interface.rows import SIMULATOR
from cellwright.clients.client import Client
from cellwright.middleware.ros1.host import ros1
from cellwright.running.run import RunResult, ServerOptions, Session
from tests.support.cells import BARE, KITTING
from tests.support.waiting import TIMEOUT


def test_client_over_socket_works_served_session() -> None:
    with Session(cellwright.Cell(KITTING), serve=ServerOptions(port=0, lockstep=True)) as session:

        def work() -> None:
            client = Client.connect(session.address or ("", 0))
            client.sleep(0.2)
            client.close()
            session.stop.request()

        thread = threading.Thread(target=work)
        thread.start()
        result = session.run()
        thread.join(TIMEOUT)
    assert isinstance(result, RunResult)
    assert (result.simulated, result.pace) == (0.2, None)


def test_session_that_is_a_node_of_ros_serves_and_joins(monkeypatch: pytest.MonkeyPatch) -> None:
    joined: list[tuple[str, int]] = []

    class Ros(ExitStack):
        identity = SIMULATOR

        def __init__(self, *_: object, **__: object) -> None:
            super().__init__()

        def prepare(self) -> None:
            pass

        def poll(self) -> None:
            pass

        def join(self, address: tuple[str, int], *_: object) -> bool:
            joined.append(address)
            return True

    monkeypatch.setattr(ros1, "Ros1", Ros)
    with Session(BARE, serve=ServerOptions(port=0, ros1=True)) as session:
        session.run(until=0.1)
        session.run(until=0.1)
        assert joined == [session.address], "once"
