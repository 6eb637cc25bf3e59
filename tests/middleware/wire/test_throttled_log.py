from types import SimpleNamespace

import pytest

from cellwright.middleware.wire.event_loop import LOG_PERIOD, EventLoop, ThrottledLog


def test_throttled_log_reports_first_at_once_and_rest_after_a_second(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr("cellwright.middleware.wire.event_loop.time", SimpleNamespace(monotonic=lambda: now[0]))
    loop = EventLoop()
    tally = ThrottledLog(loop, "{count} of {subject}")

    def run_to(seconds: float) -> str:
        now[0] = seconds
        loop.call(loop.stop, 0)
        loop.run()
        return capsys.readouterr().err

    for _ in range(5):
        tally.count("apples")
    tally.count("pears")
    assert run_to(0.0) == "1 of apples\n1 of pears\n"
    assert run_to(0.9 * LOG_PERIOD) == ""
    assert run_to(LOG_PERIOD) == "4 of apples\n"
    assert run_to(2 * LOG_PERIOD) == ""
    assert not tally._counts  # subjects without new events are forgotten
    loop.close()
