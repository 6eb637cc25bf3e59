"""Joint positions for tests of motions, and strategies for more."""

import math

from hypothesis import strategies as st

from cellwright.motion import Joints, solve, tool_down

INITIAL = Joints(0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
ABOVE_BIN = solve(tool_down(-0.3, 0.23, 1.0), INITIAL)
ABOVE_TRAY = solve(tool_down(0.3, 3.1, 1.0), ABOVE_BIN)
ABOVE_BELT = solve(tool_down(1.1, 1.5, 1.1), INITIAL)

_ANGLES = st.floats(-2 * math.pi, 2 * math.pi, allow_subnormal=False)
anywhere = st.builds(Joints, st.floats(-2.1, 2.1, allow_subnormal=False), *(_ANGLES,) * 6)
"""Joints within their limits."""

moderate = st.builds(Joints, st.floats(-2.0, 2.0), *(st.floats(-3.0, 3.0),) * 6)
"""Joints that are not near their limits."""


def farthest(a: Joints, b: Joints) -> float:
    """Return the largest difference of a joint [rad; m]."""
    return max(abs(p - q) for p, q in zip(a, b, strict=True))
