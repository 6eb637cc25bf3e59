import json
from collections.abc import Iterable

from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.conveyor import Appearance, PopulationSchedule
from cellwright.config.trial.trial import BeltPart
from cellwright.engine.clock import NEVER
from cellwright.util.pose import Pose

SECOND = 1_000_000_000
STEP = 2_000_000

parts = st.lists(
    st.builds(BeltPart, st.floats(0.0, 0.1).map(lambda t: round(t, 4)), st.sampled_from("abc"), st.just(Pose())),
    max_size=5,
)
commands = st.dictionaries(
    st.integers(0, 150),
    st.one_of(st.floats(0.0, 100.0), st.sampled_from(["pause", "resume", "restart", 0.0, 50.0, 100.0])),
    max_size=6,
)


def command(schedule: PopulationSchedule, word: str | float, now: int) -> None:
    if word == "pause":
        schedule.pause(now)
    elif word == "resume":
        schedule.resume(now)
    elif word == "restart":
        schedule.restart(now)
    else:
        schedule.set_power(float(word), now)


def part(time: float, type_: str) -> BeltPart:
    return BeltPart(time, type_, Pose((0.0, 0.0, 0.1)))


def appearances(schedule: PopulationSchedule, steps: Iterable[int]) -> list[tuple[int, str, int]]:
    got = [(step, schedule.pop(step * STEP)) for step in steps]
    return [(step, one.type, one.clone) for step, one in got if one is not None]


@given(parts, commands)
def test_pop_at_due_times_equals_pop_at_every_step(parts: list[BeltPart], commands: dict[int, str | float]) -> None:
    stepped, driven = PopulationSchedule(parts), PopulationSchedule(parts)
    for schedule in (stepped, driven):
        schedule.restart(0)
    pops = 0
    for step in range(200):
        now = step * STEP
        if step in commands:
            command(stepped, commands[step], now)
            command(driven, commands[step], now)
        expected = stepped.pop(now)
        if driven.next_due() <= now:
            pops += 1
            assert driven.pop(now) == expected
        else:
            assert expected is None
    assert stepped.get_state() == driven.get_state()


def test_parts_appear_in_order_at_first_step_when_due() -> None:
    schedule = PopulationSchedule([part(9.9, "disk_part"), part(4.9, "gasket_part")])
    schedule.restart(SECOND)
    assert schedule.next_due() == 5_900_000_000
    assert schedule.pop(5_899_999_999) is None
    assert schedule.pop(5_900_000_000) == Appearance("gasket_part", 0, Pose((0.0, 0.0, 0.1)), in_pool=True)
    assert schedule.next_due() == 10_900_000_000


def test_list_restarts_when_last_part_appears() -> None:
    schedule = PopulationSchedule([part(0.01, "a"), part(0.03, "b")], cycles=2)
    schedule.restart(0)
    assert appearances(schedule, range(50)) == [
        (5, "a", 0),
        (15, "b", 0),
        (20, "a", 1),
        (30, "b", 1),
        (35, "a", 2),
        (45, "b", 2),
    ]


def test_next_round_starts_when_last_part_was_popped() -> None:
    schedule = PopulationSchedule([part(1.0, "a")])
    schedule.restart(0)
    assert schedule.pop(3 * SECOND) is not None
    assert schedule.next_due() == 4 * SECOND


def test_at_most_one_part_appears_per_step() -> None:
    schedule = PopulationSchedule([part(0.0, "a"), part(0.0, "b"), part(0.01, "c")])
    schedule.restart(0)
    assert appearances(schedule, [0, 0, 1, 2, 5]) == [(0, "a", 0), (1, "b", 0), (5, "c", 0)]


def test_clone_numbers_count_up_and_pool_runs_out() -> None:
    schedule = PopulationSchedule([part(0.002, "a"), part(0.004, "b"), part(0.006, "a")], cycles=2)
    schedule.restart(0)
    got = [one for step in range(20) if (one := schedule.pop(step * STEP)) is not None]
    of_a = [one for one in got if one.type == "a"]
    assert [one.name for one in of_a[:3]] == [f"populate_conveyor|a_clone_{k}" for k in range(3)]
    assert [one.in_pool for one in of_a] == [True] * 4 + [False] * (len(of_a) - 4)
    assert len(of_a) > 4


def test_schedule_without_cycles_has_empty_pool() -> None:
    schedule = PopulationSchedule([part(0.002, "a")], cycles=0)
    schedule.restart(0)
    one = schedule.pop(STEP)
    assert one is not None
    assert not one.in_pool


def test_restart_keeps_clone_numbers() -> None:
    schedule = PopulationSchedule([part(0.002, "a"), part(1.0, "a")])
    schedule.restart(0)
    assert appearances(schedule, range(3)) == [(1, "a", 0)]
    schedule.restart(10 * STEP)
    assert appearances(schedule, range(10, 13)) == [(11, "a", 1)]


def test_power_rescales_remaining_time() -> None:
    schedule = PopulationSchedule([part(10.0, "a")])
    schedule.set_power(50.0, 0)
    schedule.restart(0)
    assert schedule.next_due() == 20 * SECOND
    schedule.set_power(100.0, 4 * SECOND)
    assert schedule.next_due() == 12 * SECOND
    schedule.set_power(0.0, 5 * SECOND)
    assert schedule.next_due() == NEVER
    schedule.set_power(10.0, 100 * SECOND)
    assert schedule.next_due() == 170 * SECOND
    assert schedule.pop(170 * SECOND) is not None


def test_pause_keeps_progress() -> None:
    schedule = PopulationSchedule([part(10.0, "a")])
    schedule.restart(0)
    schedule.pause(3 * SECOND)
    schedule.pause(4 * SECOND)
    assert not schedule.running
    assert schedule.progress(9 * SECOND) == 3 * SECOND
    assert schedule.next_due() == NEVER
    assert schedule.pop(50 * SECOND) is None
    schedule.resume(60 * SECOND)
    schedule.resume(61 * SECOND)
    assert schedule.next_due() == 67 * SECOND


def test_nothing_is_due_before_start_or_from_empty_list() -> None:
    assert PopulationSchedule([part(0.0, "a")]).next_due() == NEVER
    empty = PopulationSchedule([])
    empty.restart(0)
    assert empty.pop(SECOND) is None


def test_nearly_stopped_belt_is_never_due() -> None:
    schedule = PopulationSchedule([part(10.0, "a")])
    schedule.set_power(5e-324, 0)
    schedule.restart(0)
    assert schedule.next_due() == NEVER


@given(parts, commands, st.integers(0, 150))
def test_restored_schedule_continues_alike(parts: list[BeltPart], commands: dict[int, str | float], at: int) -> None:
    schedule = PopulationSchedule(parts)
    schedule.restart(0)
    for step in range(at):
        if step in commands:
            command(schedule, commands[step], step * STEP)
        schedule.pop(step * STEP)
    other = PopulationSchedule(parts)
    other.set_state(json.loads(json.dumps(schedule.get_state())))
    assert appearances(other, range(at, at + 100)) == appearances(schedule, range(at, at + 100))
    assert other.get_state() == schedule.get_state()
    schedule.reset()
    assert schedule.get_state() == PopulationSchedule(parts).get_state()


def test_delay_applies_to_first_round_after_each_start() -> None:
    schedule = PopulationSchedule([part(1.0, "a"), part(3.0, "b")], 9, delay=0.5)
    schedule.restart(10 * SECOND)
    times = []
    for _ in range(4):
        times.append(schedule.next_due())
        schedule.pop(times[-1])
    assert [time / SECOND for time in times] == [11.5, 13.5, 14.5, 16.5]  # the second round is on time
    schedule.restart(20 * SECOND)
    assert schedule.next_due() == 21.5 * SECOND


def test_delay_is_rescaled_by_power() -> None:
    schedule = PopulationSchedule([part(1.0, "a")], delay=0.5)
    schedule.set_power(50.0, 0)
    schedule.resume(0)
    assert schedule.next_due() == 3 * SECOND
    state = json.loads(json.dumps(schedule.get_state()))
    other = PopulationSchedule([part(1.0, "a")], delay=0.5)
    other.set_state(state)
    assert other.next_due() == 3 * SECOND


@given(st.integers(0, 6 * SECOND))
def test_zero_delay_equals_no_delay(time: int) -> None:
    plain, with_none = PopulationSchedule([part(1.0, "a")]), PopulationSchedule([part(1.0, "a")], delay=0.0)
    for schedule in (plain, with_none):
        schedule.restart(0)
        schedule.pop(time)
    assert plain.get_state() == with_none.get_state()
