"""Joint states of `joint_state_broadcaster`: a frame in the header, and all else as it was."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.ros2.bridge.broadcast import with_frame

_VALUES = st.lists(st.floats(-1e6, 1e6), max_size=4)


@given(names=st.lists(st.text(max_size=8), max_size=4), values=_VALUES, time=st.integers(0, 10**15))
def test_message_without_frame_gets_that_of_broadcaster(names: list[str], values: list[float], time: int) -> None:
    bare, framed = (
        TYPES.to_cdr(joint_state(names, values, values, values, frame=frame, time=time)) for frame in ("", "base_link")
    )
    assert with_frame(bare) == framed


@given(frame=st.text("abc_", min_size=1, max_size=12))
def test_message_with_frame_keeps_it(frame: str) -> None:
    sent = TYPES.to_cdr(joint_state(["a"], [1.0], frame=frame, time=0))
    assert with_frame(sent) == sent
