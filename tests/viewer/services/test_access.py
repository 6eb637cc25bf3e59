"""Access to the viewer services: any client in development mode, the server's own page alone in a competition."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import PROTOCOL, Frame, FrameKind
from cellwright.robot.node import RobotNode
from cellwright.viewer.services import scene
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.names import CONTROL, FRAME, VIEWER_SERVICES
from tests.middleware.server.talk import Hall, Talker, served
from tests.robot.robots import two_arms
from tests.support.cells import KITTING


def offered(hall: Hall, node: scene.ViewedNode, tempo: RateControl | None = None) -> None:
    scene.offer_viewer_services(hall.server, node, lambda _: {"kind": "any"}, Control(tempo or RateControl()))


def ask(client: Talker, service: str, **request: Any) -> Frame:
    return client.ask(Frame(FrameKind.CALL, 5, service, payload=json.dumps({"action": "state", **request}).encode()))


def shows(hall: Hall, key: Any) -> Talker:
    """Client that shows a value in place of a key."""
    client = hall.connect("")
    hello = {"protocol": PROTOCOL, "node": "/page_1", "encoding": "cdr", "key": key}
    client.say(Frame(FrameKind.HELLO, payload=json.dumps(hello).encode()))
    client.wait_for(FrameKind.WELCOME)
    return client


@pytest.mark.parametrize("service", VIEWER_SERVICES)
def test_competition_answers_own_page_only(service: str) -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        offered(hall, cell)
        other, page = hall.connect("/page_2"), shows(hall, hall.server.key)
        refused = ask(other, service)
        assert (refused.kind, refused.name) == (FrameKind.REFUSED, "RejectedCommandError")
        assert refused.text() == scene.ITS_OWN_PAGE
        assert ask(page, service).kind in (FrameKind.ANSWER, FrameKind.DATA)


@pytest.mark.parametrize("node", [lambda: Cell(KITTING, competition=False), lambda: RobotNode(two_arms())])
def test_development_mode_and_robot_answer_any_client(node: Any) -> None:
    cell = node()
    with served(cell) as hall:
        offered(hall, cell)
        assert hall.server.key == ""
        for client in (hall.connect(), shows(hall, "an old key")):
            assert {ask(client, service).kind for service in VIEWER_SERVICES} == {FrameKind.ANSWER, FrameKind.DATA}


def test_client_without_key_cannot_pause_competition() -> None:
    cell, tempo = Cell(KITTING), RateControl(1.0)
    with served(cell) as hall:
        offered(hall, cell, tempo)
        assert ask(hall.connect(), CONTROL, action="pause").kind is FrameKind.REFUSED
        assert not tempo.is_paused


NO_KEYS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text() | st.text(st.characters(categories=["Cs"]), min_size=1),
    lambda each: st.lists(each, max_size=3) | st.dictionaries(st.text(), each, max_size=3),
)


@pytest.mark.slow
@given(NO_KEYS)
def test_invalid_key_is_ignored_and_client_admitted(shown: Any) -> None:
    cell = _CELL
    with served(cell) as hall:
        offered(hall, cell)
        assert ask(shows(hall, shown), FRAME).kind is FrameKind.REFUSED


def test_key_of_another_server_is_refused() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall, served(cell) as later:
        for each in (hall, later):
            offered(each, cell)
        client = shows(later, hall.server.key)
        assert ask(client, FRAME).kind is FrameKind.REFUSED


_CELL = Cell(KITTING)
