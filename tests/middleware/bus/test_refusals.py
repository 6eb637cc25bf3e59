from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import Refusals
from cellwright.middleware.bus.refusals import MAX_KINDS, MAX_LINE_LENGTH, MAX_LINES, MAX_SOURCES, OTHERS

SECOND = 10**9


class Desk:
    """Refusals with a clock that the test sets."""

    def __init__(self) -> None:
        self.now = 0
        self.lines: list[str] = []
        self.refusals = Refusals(lambda: self.now, self.lines.append)

    def refuse(self, source: str = "/arm", reason: str = "no", at: int = 0) -> None:
        self.now = at
        self.refusals.refuse(source, reason)


def test_first_refusal_is_reported_at_once_and_flood_once_a_second() -> None:
    desk = Desk()
    for tick in range(0, 3 * SECOND, 2_000_000):
        desk.refuse(at=tick)
    assert desk.lines == [
        "refused /arm: no",
        "refused /arm: no (and 499 more since the last report)",
        "refused /arm: no (and 499 more since the last report)",
    ]
    assert desk.refusals.total == 1500
    desk.refusals.flush()
    desk.refusals.flush()
    assert desk.lines[3:] == ["refused /arm: 499 more since the last report"]


def test_refusals_of_two_sources_and_of_two_kinds_are_all_reported() -> None:
    desk = Desk()
    desk.refuse("/arm", "one")
    desk.refuse("/agv", "two")
    desk.refuse("/arm", "three", at=SECOND // 2)
    desk.refuse("/arm", "one", at=SECOND - 1)
    desk.refuse("/arm", "one", at=SECOND)
    assert desk.lines == [
        "refused /arm: one",
        "refused /agv: two",
        "refused /arm: three",
        "refused /arm: one (and 1 more since the last report)",
    ]
    assert desk.refusals.counts == {"/arm": 4, "/agv": 1}


def test_refusals_that_differ_in_their_values_are_of_one_kind() -> None:
    desk = Desk()
    for number in range(50):
        desk.refuse(reason=f"the position of 'joint_{number}' must be at most 1.5 (got {number}.25e-3, of {[number]})")
    assert len(desk.lines) == 1


def test_one_source_with_many_kinds_leaves_lines_to_others() -> None:
    desk = Desk()
    for letter in "abcdefghijklmnopqrstuvwxyz":
        desk.refuse("/rude", letter)
    desk.refuse("/arm", "no")
    assert [line.split()[1] for line in desk.lines] == ["/rude:"] * MAX_KINDS + ["/arm:"]
    desk.refuse("/rude", "again", at=SECOND)
    assert desk.lines[-1] == f"refused /rude: again (and {26 - MAX_KINDS} more since the last report)"


def test_refusal_after_restart_of_time_is_reported_at_once() -> None:
    desk = Desk()
    desk.refuse(at=100 * SECOND)
    desk.refuse(at=0)
    assert len(desk.lines) == 2


def test_refusals_of_too_many_sources_share_one_count() -> None:
    desk = Desk()
    for number in range(3 * MAX_SOURCES):
        desk.refuse(f"/node_{number}")
    assert len(desk.refusals.counts) == MAX_SOURCES + 1
    assert desk.refusals.counts[OTHERS] == 2 * MAX_SOURCES
    assert len(desk.lines) == MAX_LINES
    desk.refusals.flush()
    assert len(desk.lines) == 2 * MAX_LINES + 1
    assert sum(map(numbers_in, desk.lines[MAX_LINES:])) == 3 * MAX_SOURCES - MAX_LINES


def numbers_in(line: str) -> int:
    """Return the number of refusals in a line of the end."""
    return int(line.split(" more")[0].split()[-1])


def test_refusals_of_many_sources_are_reported_again_after_a_second() -> None:
    desk = Desk()
    for second in range(3):
        for number in range(100):
            desk.refuse(f"/node_{number}", at=second * SECOND)
    assert len(desk.lines) == 3 * MAX_LINES
    desk.refuse("/node_0", at=0)  # a restarted run
    assert len(desk.lines) == 3 * MAX_LINES + 1


def test_refusal_with_long_text_is_reported_in_one_short_line() -> None:
    desk = Desk()
    desk.refuse("/arm\n\x1b[2J", "x" * 10_000_000)
    desk.refusals.flush()
    (line,) = desk.lines
    assert len(line) == MAX_LINE_LENGTH
    assert line.startswith("refused /arm??[2J: xxx")
    desk.refuse("/a" * 100_000)
    assert list(desk.refusals.counts) == ["/arm??[2J", f"{'/a' * 200}"[:397] + "..."]


@given(st.lists(st.tuples(st.sampled_from(["/a", "/b"]), st.integers(0, 2 * SECOND)), max_size=40))
def test_random_refusals_are_all_counted(events: list[tuple[str, int]]) -> None:
    desk = Desk()
    now = 0
    reported: dict[str, list[int]] = {"/a": [], "/b": []}
    for source, pause in events:
        now += pause
        before = len(desk.lines)
        desk.refuse(source, at=now)
        if len(desk.lines) > before:
            reported[source].append(now)
    desk.refusals.flush()
    assert desk.refusals.total == len(events)
    lines = [line for line in desk.lines if "more" in line]
    more = sum(int(line.split(" more")[0].split()[-1]) for line in lines)
    said = sum(line.startswith("refused") and ": no" in line for line in desk.lines)
    assert said + more == len(events)
    for times in reported.values():
        assert all(b - a >= SECOND for a, b in pairwise(times))
