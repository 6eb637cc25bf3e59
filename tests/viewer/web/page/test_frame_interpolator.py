"""Even motion between frames, and none without a cause."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.scene import SceneFrame
from cellwright.viewer.web.page import FrameInterpolator, interpolate_frames
from tests.rendering.scene.scenes import frames

PERIOD = 1 / 20


def at(x: float, time: int = 0, shown: bool = True) -> SceneFrame:
    poses = np.array([(0, 0, 0, 1, 0, 0, 0), (x, 0, 0, 1, 0, 0, 0)], np.float32)
    return SceneFrame(time, poses, np.array([True, shown]))


def test_interpolator_gives_even_motion() -> None:
    moments, seen = FrameInterpolator(), list[float]()
    for number in range(30):
        wall = number * PERIOD + (0.004 if number % 2 else 0.0)  # their intervals vary a little
        moments.take(at(0.01 * wall / PERIOD, number), run=1, wall=wall)
        for part in range(2):
            moment = moments.at(number * PERIOD + part * PERIOD / 2 + 0.005)
            if moment is not None:
                seen.append(float(moment.frame.poses[1, 0]))
    steps = np.diff(seen[10:])
    assert steps == pytest.approx([0.005] * len(steps), abs=0.0015)


def test_interpolator_shows_first_frame_at_once_and_unchanged_frame_once() -> None:
    moments = FrameInterpolator()
    assert moments.at(0.0) is None
    still = at(0.3)
    moments.take(still, run=1, wall=0.0)
    first = moments.at(0.0)
    assert first is not None
    assert first.is_cut
    assert first.frame is still
    assert moments.at(0.1) is None


@pytest.mark.parametrize(("run", "time"), [(2, 10), (1, 4)])
def test_interpolator_cuts_at_other_run_and_jump_back(run: int, time: int) -> None:
    moments = FrameInterpolator()
    for number, x in enumerate((0.0, 0.1)):
        moments.take(at(x, 5 + number), run=1, wall=number * PERIOD)
        moments.at(number * PERIOD)
    moments.take(at(2.0, time), run=run, wall=2 * PERIOD)
    moment = moments.at(2 * PERIOD)
    assert moment is not None
    assert moment.is_cut
    assert moment.frame.poses[1, 0] == 2.0


def test_interpolator_shows_rare_frames_as_they_come() -> None:
    moments = FrameInterpolator()
    moments.take(at(0.0, 0), run=1, wall=0.0)
    moments.at(0.0)
    moments.take(at(1.0, 1), run=1, wall=2.0)
    moments.at(1.0)
    moment = moments.at(2.5)
    assert moment is not None
    assert moment.frame.poses[1, 0] == 1.0


def test_interpolation_does_not_move_body_that_jumps() -> None:
    assert interpolate_frames(at(0.0), at(3.0), 0.5).poses[1, 0] == 0.0
    assert interpolate_frames(at(0.0), at(0.2), 0.5).poses[1, 0] == pytest.approx(0.1)
    hidden = interpolate_frames(at(0.0), at(0.2, shown=False), 0.5)
    assert (hidden.poses[1, 0], bool(hidden.shown[1])) == (0.0, True)


def test_interpolation_of_turn_takes_short_way() -> None:
    before, after = at(0.0), at(0.0)
    after.poses[1, 3:] = (-0.995, 0.0, 0.0, -0.0998)  # the same turn as (0.995, 0, 0, 0.0998)
    w, _, _, z = interpolate_frames(before, after, 0.5).poses[1, 3:].tolist()
    assert (w, z) == (pytest.approx(0.9987, abs=1e-3), pytest.approx(0.05, abs=1e-3))


@pytest.mark.slow
@given(pair=st.integers(1, 6).flatmap(lambda n: st.tuples(frames(n), frames(n))), share=st.floats(0, 1))
def test_interpolation_of_any_frames_is_finite(pair: tuple[SceneFrame, SceneFrame], share: float) -> None:
    assert np.isfinite(interpolate_frames(*pair, share).poses).all()
