"""Pending responses: the caller gets them, in this process and over a socket."""

from __future__ import annotations

import pytest

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.middleware.bus import Bus, PendingResponse
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.util.errors import RunEndedError
from tests.robot.talk import RESET, Talk

YES, NO = TriggerResponse(success=True), TriggerResponse(success=False)


def test_pending_response_answered_twice_notifies_listeners_with_first() -> None:
    later, heard = PendingResponse(), list[object]()
    later.then(heard.append)
    later.then(heard.append)
    assert later.response is None
    later.answer(YES)
    later.answer(NO)
    later.then(heard.append)
    assert heard == [YES, YES, YES]
    assert later.response is YES


def test_listener_added_during_answer_is_notified_at_once() -> None:
    later, heard = PendingResponse(), list[object]()
    later.then(lambda _response: later.then(heard.append))
    later.answer(YES)
    assert heard == [YES]


def test_bus_call_with_pending_response_returns_it() -> None:
    bus, later = Bus(lambda: 0), PendingResponse()
    bus.serve("/go", "std_srvs/Trigger", lambda _request, _node: later)
    assert bus.call("/go", TriggerRequest()) is later


def test_in_process_call_with_pending_response_advances_time() -> None:
    talk = Talk()
    session = NodeClient(InProcess(talk.node, node="/me"))
    talk.joints({"waist": 0.9})
    session.sleep(0.5)
    begun = talk.node.simulation.time
    assert session.call(RESET, TriggerRequest()).success
    assert 0.3 < talk.node.simulation.time - begun < 2.0


def test_in_process_call_past_time_limit_raises_run_ended() -> None:
    talk = Talk()
    transport = InProcess(talk.node)
    talk.joints({"waist": 0.9})
    talk.seconds(0.5)
    transport.stop.limit(talk.node.simulation.now + 50_000_000)
    with pytest.raises(RunEndedError):
        transport.call(RESET, TriggerRequest())
