from __future__ import annotations

import signal
import sys
from collections.abc import Iterator

import pytest

from cellwright.cli.signals import ended_as_by_ctrl_c, stopped_by_signals
from cellwright.engine.loop import StopCondition
from cellwright.running.run.agent_work import restored_environment

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")

NUMBERS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.fixture(autouse=True)
def heard() -> Iterator[list[int]]:
    """Yield the signals that no other handler took."""
    found: list[int] = []
    before = {each: signal.signal(each, lambda number, _frame: found.append(number)) for each in NUMBERS}
    yield found
    for each, handler in before.items():
        signal.signal(each, handler)


@pytest.mark.parametrize("number", NUMBERS)
def test_first_signal_requests_stop_and_second_has_default_effect(number: int, heard: list[int]) -> None:
    stop = StopCondition()
    with stopped_by_signals(stop.request):
        signal.raise_signal(number)
        assert stop.is_requested
        assert heard == []
        signal.raise_signal(number)
        assert heard == [number]


@pytest.mark.parametrize("number", NUMBERS[1:])
def test_other_signals_act_as_ctrl_c(number: int, heard: list[int]) -> None:
    with pytest.raises(KeyboardInterrupt), ended_as_by_ctrl_c():
        signal.raise_signal(number)
    signal.raise_signal(number)
    assert heard == [number]


@pytest.mark.parametrize("number", NUMBERS[1:])
def test_other_signals_act_as_ctrl_c_after_agent_changed_handlers(number: int, heard: list[int]) -> None:
    def work() -> None:
        with restored_environment():
            signal.raise_signal(number)

    with ended_as_by_ctrl_c():
        with pytest.raises(KeyboardInterrupt):
            work()
        signal.raise_signal(number)
        assert heard == [number]
    signal.raise_signal(number)
    assert heard == [number, number]


def test_ignored_signal_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with stopped_by_signals(lambda: pytest.fail("it was to be ignored")), ended_as_by_ctrl_c():
        signal.raise_signal(signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
