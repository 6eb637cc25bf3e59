"""Whole turns of angles within the limits of a joint."""

import math

ROUNDING = 1e-9
"""Distance [rad] beyond a limit that counts as at the limit."""

FULL_TURN = 2.0 * math.pi
"""A whole turn [rad]."""


def turn_range(angle: float, lower: float, upper: float) -> tuple[int, int]:
    """Return the minimum and maximum number of whole turns that can be added to an angle within finite limits [rad].

    The minimum is the greater one if the angle has no place within the limits.
    """
    return math.ceil((lower - ROUNDING - angle) / FULL_TURN), math.floor((upper + ROUNDING - angle) / FULL_TURN)


def turned(angle: float, turns: int, lower: float, upper: float) -> float:
    """Return an angle with whole turns added, at the limit if rounding carried it beyond [rad]."""
    return max(lower, min(upper, angle + turns * FULL_TURN))


def turns_to(angle: float, near: float) -> int:
    """Return the number of whole turns that bring an angle nearest to another [rad]; the lower one of two as near."""
    return math.ceil((near - angle) / FULL_TURN - 0.5)


def nearest_turn(angle: float, near: float, lower: float, upper: float) -> float | None:
    """Return the angle that is nearest to another, by whole turns within limits, which may be infinite [rad].

    It is None if no whole number of turns brings the angle within the limits.

    Example:
        >>> nearest_turn(-3.0, 3.0, -6.0, 6.0)
        3.2831853071795862
        >>> nearest_turn(-3.0, 3.0, -2.0, 2.0) is None
        True
    """
    low = -math.inf if lower == -math.inf else math.ceil((lower - ROUNDING - angle) / FULL_TURN)
    high = math.inf if upper == math.inf else math.floor((upper + ROUNDING - angle) / FULL_TURN)
    if low > high:
        return None
    return turned(angle, int(max(low, min(high, turns_to(angle, near)))), lower, upper)


def principal(angle: float) -> float:
    """Return the same angle [rad] from -pi to pi."""
    return math.remainder(angle, FULL_TURN)
