import json

from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.clock import NEVER, Event, EventQueue

entries = st.lists(st.tuples(st.integers(0, 20), st.integers(-2, 2), st.sampled_from("abc")), max_size=40)


def drain(queue: EventQueue, now: int = NEVER) -> list[Event]:
    events = []
    while (event := queue.pop_due(now)) is not None:
        events.append(event)
    return events


def fill(waiting: list[tuple[int, int, str]]) -> EventQueue:
    queue = EventQueue()
    for time, priority, device in waiting:
        queue.schedule(time, device, "kind", (time,), priority)
    return queue


@given(entries)
def test_events_come_by_time_priority_and_order_of_scheduling(waiting: list[tuple[int, int, str]]) -> None:
    got = [(event.time, event.priority, event.serial) for event in drain(fill(waiting))]
    assert got == sorted((time, priority, serial) for serial, (time, priority, _) in enumerate(waiting))


@given(entries, st.integers(0, 20))
def test_pop_due_returns_only_due_events(waiting: list[tuple[int, int, str]], now: int) -> None:
    queue = fill(waiting)
    assert len(drain(queue, now)) == sum(time <= now for time, *_ in waiting)
    assert queue.next_due == min((time for time, *_ in waiting if time > now), default=NEVER)


@given(entries, st.integers(0, 20))
def test_restored_event_queue_continues_identically(waiting: list[tuple[int, int, str]], now: int) -> None:
    queue = fill(waiting)
    drain(queue, now)
    other = EventQueue()
    other.set_state(json.loads(json.dumps(queue.get_state())))
    for each in (queue, other):
        each.schedule(now, "d", "late", (), 0)
    assert drain(queue) == drain(other)


def test_cancel_removes_one_kind_of_one_device() -> None:
    queue = EventQueue()
    queue.schedule(1, "a", "x", (), 0)
    queue.schedule(2, "a", "y", (), 0)
    queue.schedule(3, "b", "x", (), 0)
    queue.cancel("a", "x")
    queue.cancel("a", "x")
    assert queue.next_due == 2
    assert [event.device for event in drain(queue)] == ["a", "b"]


def test_clear_empties_event_queue() -> None:
    queue = fill([(1, 0, "a")])
    queue.clear()
    assert queue.get_state() == {"serial": 0, "events": []}
    assert queue.next_due == NEVER
