"""Templates of encoded messages: the same bytes as those of the message itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import header, joint_state, single, singles, stamp
from cellwright.middleware.messages.standard import (
    Clock,
    Header,
    LaserScan,
    Quaternion,
    Range,
    TFMessage,
    Transform,
    TransformStamped,
    Vector3,
)
from cellwright.middleware.messages.template import CdrTemplate, CdrTemplates, stamp_cdr

TIMES = st.integers(0, (1 << 31) * 10**9 - 1)
NUMBERS = st.floats(width=64)
WORDS = st.text("abc_", max_size=9)


@given(TIMES)
def test_stamp_has_bytes_of_clock(time: int) -> None:
    assert stamp_cdr(time) == TYPES.to_cdr(Clock(stamp(time)))


@settings(deadline=None)
@given(TIMES, WORDS, st.lists(WORDS, max_size=4), st.data())
def test_filled_joint_state_has_bytes_of_message(time: int, frame: str, names: list[str], data: st.DataObject) -> None:
    count = len(names)
    numbers = data.draw(st.lists(NUMBERS, min_size=3 * count, max_size=3 * count))
    columns = numbers[:count], numbers[count : 2 * count], numbers[2 * count :]
    zeros = [0.0] * count
    template = CdrTemplate(
        joint_state(names, zeros, zeros, zeros, frame=frame), TYPES, ("position", "velocity", "effort")
    )
    assert template.filled(time, numbers) == TYPES.to_cdr(joint_state(names, *columns, frame=frame, time=time))


@settings(deadline=None)
@given(TIMES, st.lists(st.tuples(WORDS, WORDS, st.lists(NUMBERS, min_size=7, max_size=7)), max_size=4))
def test_filled_frames_have_bytes_of_message(time: int, frames: list[tuple[str, str, list[float]]]) -> None:
    def message(at: int, *, is_zero: bool) -> TFMessage:
        return TFMessage(
            [
                TransformStamped(
                    Header(stamp(at), parent), child, Transform(Vector3(*values[:3]), Quaternion(*values[3:]))
                )
                for parent, child, numbers in frames
                for values in [[0.0] * 7 if is_zero else numbers]
            ]
        )

    template = CdrTemplate(message(0, is_zero=True), TYPES, ("x", "y", "z", "w"))
    numbers = [number for *_, each in frames for number in each]
    assert template.filled(time, numbers) == TYPES.to_cdr(message(time, is_zero=False))


@settings(deadline=None)
@given(TIMES, WORDS, st.lists(st.floats(width=32), min_size=5, max_size=5))
def test_filled_ranges_have_bytes_of_message(time: int, frame: str, ranges: list[float]) -> None:
    def scan(values: list[float], at: int) -> LaserScan:
        fan = (-0.5, 0.5, 0.25, 0.0, 0.0, 0.125, 0.75)
        return LaserScan(header(frame, at), *fan, singles(values), singles(np.zeros(5)))

    template = CdrTemplate(scan([0.0] * 5, 0), TYPES, ("ranges",))
    assert template.filled(time, ranges) == TYPES.to_cdr(scan(ranges, time))
    alone = CdrTemplate(Range(header(frame), 1, 0.125, 0.0, 0.5, 0.0, 0.0), TYPES, ("range",))
    assert alone.filled(time, ranges[0]) == TYPES.to_cdr(
        Range(header(frame, time), 1, 0.125, 0.0, 0.5, single(ranges[0]), 0.0)
    )


def test_templates_make_one_for_each_shape() -> None:
    templates, made = CdrTemplates(TYPES, ("position",)), []
    for names in (["a"], ["b"], ["a"]):
        message = joint_state(names, [1.0], time=7)

        def build(message: object = message) -> object:
            made.append(message)
            return message

        assert templates.filled(names[0], build, 7, [1.0]) == TYPES.to_cdr(message)  # type: ignore[arg-type]
    assert len(made) == 2


def test_template_with_wrong_number_of_values_is_refused() -> None:
    template = CdrTemplate(joint_state(["a", "b", "c"], [0.0, 0.0, 0.0]), TYPES, ("position",))
    with pytest.raises(ValueError, match="broadcast"):
        template.filled(0, [1.0, 2.0])
