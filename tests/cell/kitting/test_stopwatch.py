import json

from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.scorer import Stopwatch


@given(st.lists(st.tuples(st.integers(0, 10**9), st.booleans()), max_size=20), st.integers(0, 10**9))
def test_stopwatch_adds_up_time_while_running(presses: list[tuple[int, bool]], rest: int) -> None:
    watch, now, expected, running = Stopwatch(), 0, 0, False
    for wait, run in [*presses, (rest, False)]:
        now += wait
        expected += wait if running else 0
        assert watch.elapsed(now) == expected
        running = run
        (watch.run if run else watch.halt)(now)
        copy = Stopwatch()
        copy.set_state(json.loads(json.dumps(watch.get_state())))
        assert copy.elapsed(now + 7) == watch.elapsed(now + 7)
