"""Command delay: counted motions, and ignored ones."""

from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.robot_state import MAX_DELAY, Delay
from tests.viewer.web.operator.robots import state


def moved(by: float) -> tuple[Pose, ...]:
    return tuple(Pose((by, 0.0, 0.0)) @ tip for tip in state().tips)


def test_delay_is_median_from_request_to_motion() -> None:
    delay = Delay()
    for number, seconds in enumerate((0.03, 0.05, 0.04)):
        started_at = 10.0 * number
        delay.begin(state(), started_at)
        delay.begin(state(), started_at + 0.01)
        delay.look(state(tips=moved(1e-4)), started_at + seconds - 0.01)
        delay.look(state(tips=moved(1e-2)), started_at + seconds)
        delay.look(state(tips=moved(2e-2)), started_at + seconds + 0.1)
    assert delay.seconds is not None
    assert abs(delay.seconds - 0.04) < 1e-9, "the median"


def test_delay_ends_with_joint_motion() -> None:
    delay = Delay()
    delay.begin(state(), 0.0)
    positions = list(state().positions)
    positions[0] = (positions[0] or 0.0) + 0.1
    delay.look(state(positions=tuple(positions)), 0.02)
    assert delay.seconds == 0.02


def test_delay_without_motion_is_none() -> None:
    delay = Delay()
    delay.begin(state(), 0.0)
    delay.look(state(tips=moved(0.1)), MAX_DELAY + 0.1)
    assert delay.seconds is None
    delay.begin(state(), 10.0)
    delay.forget()
    delay.look(state(tips=moved(0.1)), 10.1)
    assert delay.seconds is None
    delay.begin(state(), 20.0)
    delay.look(state(positions=(0.0,)), 20.1)
    assert delay.seconds is None, "it is another robot"
