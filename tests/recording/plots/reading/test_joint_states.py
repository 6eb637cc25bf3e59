"""Joint states: the same as the library's, only faster."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.messages.standard import Header, JointState, Time
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.robot import JointStateReader
from cellwright.util.errors import MessageError
from tests.recording.plots.reading.recordings import message

NAMES = st.lists(st.text(max_size=9), max_size=6, unique=True)
POSITIONS = st.floats(allow_nan=False, allow_infinity=False)


def state(names: list[str], positions: list[float], frame: str = "", second: int = 0) -> JointState:
    stamp = Time(sec=second, nanosec=5)
    return JointState(
        header=Header(stamp=stamp, frame_id=frame),
        name=names,
        position=np.array(positions, dtype=np.float64),
        velocity=np.zeros(2),
        effort=np.zeros(0),
    )


@pytest.mark.slow
@settings(max_examples=25)
@given(
    st.lists(
        st.tuples(NAMES, st.text(max_size=3)).flatmap(
            lambda named: st.tuples(
                st.just(named[0]),
                st.just(named[1]),
                st.lists(st.lists(POSITIONS, min_size=len(named[0]), max_size=len(named[0])), min_size=1, max_size=3),
            )
        ),
        max_size=4,
    )
)
def test_curves_follow_changing_joint_names(tables: list[tuple[list[str], str, list[list[float]]]]) -> None:
    reader, expected, now = JointStateReader("/joints"), dict[str, list[tuple[float, float]]](), 0
    for names, frame, rows in tables:
        for row in rows:
            reader.take(message(now, state(names, row, frame, now)))
            for name, position in zip(names, row, strict=True):
                expected.setdefault(name, []).append((float(now), position))
            now += 1
    curves = reader.curves()
    assert set(curves) == set(expected)
    for name, (times, positions) in curves.items():
        assert sorted(zip(times.tolist(), positions.tolist(), strict=True)) == sorted(expected[name])


@given(st.integers(0, 150), st.integers(0, 150))
def test_truncated_joint_states_are_left_out(first: int, second: int) -> None:
    whole = message(1.0, state(["a", "b"], [1.0, 2.0]))
    reader = JointStateReader("/joints")
    for place, length in enumerate((first, 200, second)):
        try:
            reader.take(RecordedMessage("/joints", place, whole.data[:length]))
        except MessageError:
            continue
    times, positions = reader.curves()["b"]
    assert set(positions.tolist()) == {2.0}
    assert 1e-9 in times


def test_names_and_positions_of_other_lengths_are_refused() -> None:
    with pytest.raises(MessageError, match="must have the same length"):
        JointStateReader("/joints").take(message(0.0, state(["a", "b"], [1.0])))


def test_big_endian_joint_states_are_refused() -> None:
    from cellwright.middleware.messages import TYPES

    data = bytes(TYPES.ros2.serialize_cdr(state(["a"], [1.0]), JointState.__msgtype__, little_endian=False))
    with pytest.raises(MessageError, match="must be little-endian"):
        JointStateReader("/joints").take(RecordedMessage("/joints", 0, data))
