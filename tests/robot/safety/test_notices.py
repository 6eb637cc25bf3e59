"""Notices: throttled lines, and limited names."""

from __future__ import annotations

from typing import Any

from cellwright.robot.safety import MAX_LINES_PER_SECOND, MAX_NAMES, Notices

SECOND = 1_000_000_000


class Clock:
    now = 0


def make_notices() -> tuple[Notices, Clock, list[str]]:
    clock, lines = Clock(), list[str]()
    return Notices(lambda: clock.now, lines.append), clock, lines


def test_log_throttled_logs_each_kind_at_most_once_a_second() -> None:
    notices, clock, lines = make_notices()
    for tenth in range(25):
        clock.now = tenth * SECOND // 10
        notices.log_throttled("limits", f"at {tenth}")
        notices.log_throttled("other", "other")
    assert [line for line in lines if line != "other"] == ["at 0", "at 10", "at 20"]


def test_log_counts_suppressed_lines_of_a_flood() -> None:
    notices, clock, lines = make_notices()
    for _ in range(1000):
        notices.log("commands are disabled")
    assert len(lines) == MAX_LINES_PER_SECOND
    clock.now = SECOND
    notices.log("commands are enabled")
    assert lines[-1] == f"commands are enabled ({1000 - MAX_LINES_PER_SECOND} lines suppressed before)"
    notices.log("commands are disabled")
    assert lines[-1] == "commands are disabled"


def test_log_throttled_continues_after_time_restarts() -> None:
    notices, clock, lines = make_notices()
    clock.now = 100 * SECOND
    notices.log_throttled("limits", "first")
    clock.now = 0
    notices.log_throttled("limits", "second")
    assert lines == ["first", "second"]


def test_log_unknown_keeps_limited_number_of_names() -> None:
    notices, _, lines = make_notices()
    for _ in range(2):
        for number in range(1000):
            notices.log_unknown("/t", {f"{number}" * 1000: "is nothing"})
    assert len(notices.unknown) == len(lines) == MAX_NAMES
    assert all(len(name) <= 80 for name in notices.unknown)
    assert max(map(len, lines)) < 160


def test_log_unknown_skips_names_at_the_limit() -> None:
    class Unread(dict[str, str]):
        def items(self) -> Any:
            raise AssertionError("4096 names a message take their time")

    notices, _, lines = make_notices()
    notices.log_unknown("/t", {str(number): "is nothing" for number in range(MAX_NAMES)})
    notices.log_unknown("/t", Unread({"more": "is nothing"}))
    assert len(lines) == 1


def test_log_unknown_escapes_control_characters() -> None:
    notices, _, lines = make_notices()
    notices.log_unknown("/t", {"a\nb\x1b[31m": "is nothing"})
    assert lines == ["/t: 'a\\nb\\x1b[31m' is nothing; ignored (logged once)"]


def test_log_unknown_writes_many_names_in_one_line() -> None:
    notices, _, lines = make_notices()
    notices.log_unknown("/t", {"a": "is nothing"})
    notices.log_unknown("/t", dict.fromkeys("abcdefg", "is nothing"))
    assert lines[1] == "/t: 'b' is nothing, 'c' is nothing, 'd' is nothing and 3 more; ignored (logged once)"
    assert notices.unknown == list("abcdefg")
    notices.log_unknown("/t", dict.fromkeys("abcdefg", "is nothing"))
    notices.log_unknown("/t", {})
    assert len(lines) == 2
