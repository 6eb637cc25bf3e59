"""Frames as bytes: round trip, whole and as changes, and refusal of nonsense."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.scene import SceneFrame
from cellwright.rendering.scene.scene import decode_frame, is_whole_frame
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose
from tests.rendering.scene.scenes import frames

POINTS = st.tuples(*[st.floats(-3, 3)] * 3)
POSES = st.builds(Pose.from_rpy, POINTS, POINTS)


def same(one: SceneFrame, other: SceneFrame) -> bool:
    return one.time == other.time and np.array_equal(one.poses, other.poses) and np.array_equal(one.shown, other.shown)


@given(frames(5))
def test_whole_frame_decodes_without_previous_frame(frame: SceneFrame) -> None:
    assert is_whole_frame(frame.encode())
    assert same(decode_frame(frame.encode()), frame)


@pytest.mark.slow
@given(frames(4), frames(4), st.lists(st.booleans(), min_size=4, max_size=4))
def test_changes_decode_to_next_frame(first: SceneFrame, second: SceneFrame, moved: list[bool]) -> None:
    poses = np.where(np.array(moved)[:, None], second.poses, first.poses)
    then = SceneFrame(second.time, poses, np.where(moved, second.shown, first.shown))
    data = then.encode(first)
    assert not is_whole_frame(data)
    assert len(data) <= 17 + 33 * sum(moved)
    assert same(decode_frame(data, first), then)


@given(frames(3), frames(4))
def test_frame_after_other_scene_is_encoded_whole(first: SceneFrame, second: SceneFrame) -> None:
    assert same(decode_frame(second.encode(first)), second)


@given(POSES, POINTS)
def test_point_on_body_is_placed_by_its_pose(pose: Pose, point: tuple[float, float, float]) -> None:
    poses = np.array([(0, 0, 0, 1, 0, 0, 0), (*pose.position, *pose.quaternion)], np.float32)
    frame = SceneFrame(0, poses, np.ones(2, np.bool_))
    for found in (frame.pose(1).transform(point), frame.placed(1, np.array([point]))[0]):
        assert tuple(found) == pytest.approx(pose.transform(point), abs=1e-5)


@pytest.mark.slow
@given(st.binary(max_size=200))
def test_frame_of_random_bytes_is_refused(data: bytes) -> None:
    with pytest.raises(MessageError):
        decode_frame(data)


@pytest.mark.slow
@given(frames(3), st.data())
def test_damaged_frame_is_refused_or_decodes_to_valid_frame(frame: SceneFrame, data: st.DataObject) -> None:
    text = bytearray(frame.encode())
    text[data.draw(st.integers(0, len(text) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        found = decode_frame(bytes(text[: data.draw(st.integers(0, len(text)))]))
    except MessageError:
        return
    assert np.isfinite(found.poses).all()


def test_changes_without_previous_frame_are_refused() -> None:
    frame = SceneFrame(0, np.zeros((2, 7), np.float32), np.ones(2, np.bool_))
    with pytest.raises(MessageError, match="does not fit"):
        decode_frame(frame.encode(frame))
