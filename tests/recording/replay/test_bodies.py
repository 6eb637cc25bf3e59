"""Tests of speeds of bodies; held parts are tested with the assertions."""

import numpy as np
import pytest

from cellwright.recording.replay.bodies import speeds
from cellwright.rendering.scene import SceneFrame


def frame(time: float, x: float, *, shown: bool = True) -> SceneFrame:
    poses = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]], np.float32)
    return SceneFrame(round(time * 1e9), poses, np.array([True, shown]))


def test_speed_is_the_way_between_two_frames_by_their_time() -> None:
    times, found = speeds([frame(0.0, 0.0), frame(0.04, 0.02), frame(0.08, 0.02)], 1)
    assert times.tolist() == [0.04, 0.08]
    assert found.tolist() == pytest.approx([0.5, 0.0])


def test_body_that_comes_into_play_has_not_moved_there() -> None:
    times, found = speeds([frame(0.0, 9.0, shown=False), frame(0.04, 0.0), frame(0.08, 0.04)], 1)
    assert times.tolist() == [0.08]
    assert found.tolist() == pytest.approx([1.0])


def test_no_frames_have_no_speeds() -> None:
    assert [each.tolist() for each in speeds([], 0)] == [[], []]
