import pytest

from cellwright.motion import DEFAULT_LIMITS, MotionLimits, move
from cellwright.util.errors import UsageError
from tests.motion.samples import ABOVE_BIN, ABOVE_TRAY


def test_default_limits_keep_published_velocities() -> None:
    published = (3.0, 2.16, 2.16, 3.15, 3.2, 3.2, 3.2)
    assert all(mine <= theirs for mine, theirs in zip(DEFAULT_LIMITS.velocity, published, strict=True))


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_slower_limits_stretch_duration_by_factor(factor: float) -> None:
    fast = move(ABOVE_BIN, ABOVE_TRAY)
    slow = move(ABOVE_BIN, ABOVE_TRAY, DEFAULT_LIMITS.slower(factor))
    assert slow.duration == pytest.approx(factor * fast.duration)


@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_limits_not_positive_and_finite_are_refused(value: float) -> None:
    with pytest.raises(UsageError, match="positive and finite"):
        MotionLimits(DEFAULT_LIMITS.velocity._replace(elbow=value), DEFAULT_LIMITS.acceleration, DEFAULT_LIMITS.jerk)
    with pytest.raises(UsageError, match="factor must be positive"):
        DEFAULT_LIMITS.slower(value)
