"""Services called beside the operator's work: each call has an answer, even on failure."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.robot import Ask, ServiceCaller
from cellwright.util.errors import RunEndedError, UsageError
from tests.support.waiting import wait_until


class FakeTransport:
    """A transport whose calls end as a test sets."""

    def __init__(self, act: Callable[[], Any]) -> None:
        self.act = act
        self.is_closed = False

    def call(self, _service: str, _request: Any) -> Any:
        return self.act()

    def close(self) -> None:
        self.is_closed = True


def answer(services: ServiceCaller) -> str:
    """Return the result of the pending call."""
    return wait_until(services.answer, "answer")


def raising(error: BaseException) -> Callable[[], Any]:
    def act() -> Any:
        raise error

    return act


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda: SimpleNamespace(success=True, message=""), "done"),
        (lambda: SimpleNamespace(success=False, message="not now"), "refused; not now"),
        (raising(UsageError("no such thing")), "no such thing"),
        (raising(RunEndedError("the server has closed the connection")), "the server has closed the connection"),
        (raising(OSError("the cable is out")), "failed: OSError: the cable is out"),
        (lambda: None, "failed: AttributeError: 'NoneType' object has no attribute 'success'"),
    ],
)
def test_service_call_has_answer_for_every_outcome(act: Callable[[], Any], text: str) -> None:
    transport: Any = FakeTransport(act)
    services = ServiceCaller(lambda: NodeClient(transport))
    for _ in range(2):  # in threads of their own, over one connection
        assert services.begin(Ask.HOME)
        assert answer(services) == f"{Ask.HOME.value}: {text}"
        assert services.pending == ""
    services.close()
    assert transport.is_closed


def test_failed_connection_is_an_answer() -> None:
    services = ServiceCaller(raising(OSError("no route")))
    assert services.begin(Ask.ENABLE)
    assert answer(services) == f"{Ask.ENABLE.value}: failed: OSError: no route"
    services.close()
