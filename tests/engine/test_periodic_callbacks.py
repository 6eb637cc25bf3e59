from fractions import Fraction

from cellwright.engine.clock import NEVER, Clock, PeriodicCallbacks


def run(watches: PeriodicCallbacks, clock: Clock, until: int) -> None:
    while clock.now < until:
        now = clock.advance()
        if watches.next_due <= now:
            watches.run_due(now, clock.tick)


def test_samples_run_at_first_tick_when_due() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 240))
    got: list[tuple[int, int]] = []
    watches.add("laser", Fraction(1, 100), lambda index: got.append((index, clock.now)), now=0)
    run(watches, clock, 10**9)
    assert [index for index, _ in got] == list(range(1, 101))
    for index, time in got:
        assert 0 <= time - index * 10_000_000 < 4_166_668


def test_late_watch_continues_common_sample_numbers() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 500))
    clock.set_tick(777)
    got: list[int] = []
    watches.add("camera", Fraction(1, 10), got.append, now=clock.now)
    run(watches, clock, 2 * 10**9)
    assert got == [16, 17, 18, 19, 20]


def test_period_shorter_than_tick_gives_one_sample_per_tick() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[int] = []
    watches.add("fast", Fraction(1, 1000), got.append, now=0)
    run(watches, clock, 10**8)
    assert len(got) == 10
    assert got == sorted(set(got))


def test_rank_orders_watches_due_together() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[str] = []
    watches.add("each", None, lambda _: got.append("each"), now=0)
    watches.add("second", Fraction(1, 100), lambda _: got.append("second"), now=0, rank=2)
    watches.add("first", Fraction(1, 100), lambda _: got.append("first"), now=0, rank=1)
    run(watches, clock, 10**7)
    assert got == ["first", "second", "each"]


def test_rank_below_zero_runs_before_periodic_watches() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[str] = []
    watches.add("sample", Fraction(1, 100), lambda _: got.append("sample"), now=0)
    watches.add("last", None, lambda _: got.append("last"), now=0)
    clock_watch = watches.add("clock", None, lambda _: got.append("clock"), now=0, rank=-1)
    run(watches, clock, 10**7)
    assert got == ["clock", "sample", "last"]
    clock_watch.cancel()
    run(watches, clock, 2 * 10**7)
    assert got[3:] == ["sample", "last"]


def test_cancelled_watches_are_never_due() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[int] = []
    periodic = watches.add("a", Fraction(1, 50), got.append, now=0)
    each = watches.add("b", None, got.append, now=0)
    periodic.cancel()
    each.cancel()
    run(watches, clock, 10**8)
    assert got == []
    assert watches.next_due == NEVER


def test_watch_may_cancel_itself() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[int] = []

    def once(index: int) -> None:
        got.append(index)
        watch.cancel()

    watch = watches.add("once", Fraction(1, 100), once, now=0)
    run(watches, clock, 10**8)
    assert got == [1]


def test_reschedule_continues_watches_from_new_time() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[int] = []
    watches.add("a", Fraction(1, 10), got.append, now=0)
    run(watches, clock, 10**9)
    clock.set_tick(0)
    watches.reschedule(0)
    run(watches, clock, 3 * 10**8)
    assert got == [*range(1, 11), 1, 2, 3]


def test_watch_added_in_a_tick_runs_from_next_tick() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[str] = []

    def begin(rank: int) -> None:
        got.append(f"begin {rank}")
        first[rank].cancel()
        watches.add("each", None, lambda _: got.append(f"each {rank}"), clock.now, rank)

    first = {
        -1: watches.add("first", None, lambda _: begin(-1), 0, -1),
        0: watches.add("first", None, lambda _: begin(0), 0, 0),
    }
    run(watches, clock, 10**7)
    assert got == ["begin -1", "begin 0"]
    run(watches, clock, 2 * 10**7)
    assert got == ["begin -1", "begin 0", "each -1", "each 0"]


def test_queue_without_watches_is_never_due() -> None:
    watches, clock = PeriodicCallbacks(), Clock(Fraction(1, 100))
    got: list[int] = []
    watch = watches.add("each", None, got.append, now=0)
    run(watches, clock, 2 * 10**7)
    watch.cancel()
    run(watches, clock, 4 * 10**7)
    assert got == [1, 2]
    assert watches.next_due == NEVER
