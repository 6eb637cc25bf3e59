"""Periods from a value that is published repeatedly."""

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages.osrf_gear import VacuumGripperState
from cellwright.recording.plots.reading.reader import GripperReader, Spans
from tests.recording.plots.reading.recordings import message


@given(st.lists(st.sampled_from(["", "a", "b"]), min_size=1, max_size=30))
def test_spans_have_newest_label_at_each_time(labels: list[str]) -> None:
    spans = Spans()
    for time, label in enumerate(labels):
        spans.add(float(time), label)
    found = spans.until(float(len(labels)))
    for time, label in enumerate(labels):
        assert [span.label for span in found if span.begin <= time < span.end] == ([label] if label else [])


def test_gripper_states_give_spans_of_suction_and_load() -> None:
    gripper = GripperReader()
    states = [(False, False), (True, False), (True, True), (True, True), (False, False)]
    for time, (enabled, attached) in enumerate(states):
        gripper.take(message(time, VacuumGripperState(enabled=enabled, attached=attached)))
    assert [(span.begin, span.end) for span in gripper.on.until(9.0)] == [(1.0, 4.0)]
    assert [(span.begin, span.end) for span in gripper.attached.until(9.0)] == [(2.0, 4.0)]


def test_suction_until_end_gives_span_to_end() -> None:
    gripper = GripperReader()
    gripper.take(message(1.0, VacuumGripperState(enabled=True, attached=False)))
    assert [(span.begin, span.end) for span in gripper.on.until(9.0)] == [(1.0, 9.0)]
