"""Home postures: one at a singularity is refused, with a bent one nearby as the remedy.

A stretched arm cannot move its tool in every direction. Paths from there fail, and so do solvers that step from there.
"""

from collections.abc import Sequence

import numpy as np

from cellwright.motion.chain import Chain
from cellwright.motion.solver import Vector
from cellwright.util.halton import halton

MIN_SINGULAR = 0.02
"""Smallest singular value of a home [m]: there a joint turns at 5 rad/s at most for a tool at 0.1 m/s."""

_BENDS = 64  # postures that are looked at
_BEND = 1.2  # largest bend of a joint [rad; m]
_GOOD = 3 * MIN_SINGULAR  # singular value that a bent home keeps
_DIGITS = 1


def home_fault(chain: Chain, home: Sequence[float]) -> str | None:
    """Return why a home posture is refused, with the remedy; None if it is a good one.

    Args:
        chain: the arm.
        home: the posture [rad; m].

    Example:
        >>> from cellwright.motion.chain import ChainJoint
        >>> from cellwright.util.pose import Pose
        >>> arm = Chain((ChainJoint("slide", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), is_prismatic=True),), Pose())
        >>> home_fault(arm, (0.0,)) is None
        True
    """
    singular = chain.margin(home).singular
    if singular >= MIN_SINGULAR:
        return None
    fault = (
        "the arm cannot move its tool in every direction from there: the smallest singular value must be at least "
        f"{MIN_SINGULAR} m (got {singular:.4f} m)"
    )
    bent = bent_home(chain, home)
    if bent is None:
        return f"{fault}; choose a home where it is bent"
    changed = {
        joint.name: value for joint, value, before in zip(chain.joints, bent, home, strict=True) if value != before
    }
    return f"{fault}; bend it, for instance {', '.join(f'{name}: {value:g}' for name, value in changed.items())}"


def bent_home(chain: Chain, home: Sequence[float]) -> Vector | None:
    """Return a posture near a singular home that is bent, with few joints changed; None if none was found."""
    lower = np.array([max(value - _BEND, joint.lower) for value, joint in zip(home, chain.joints, strict=True)])
    upper = np.array([min(value + _BEND, joint.upper) for value, joint in zip(home, chain.joints, strict=True)])
    points = (lower + (upper - lower) * halton(_BENDS, len(home))).round(_DIGITS).tolist()
    inside = [point for point in points if chain.margin(point).limit > 0.0]
    best = max(inside, key=lambda point: chain.margin(point).singular, default=None)
    if best is None or chain.margin(best).singular < MIN_SINGULAR:
        return None
    least = min(_GOOD, chain.margin(best).singular)
    # what the arm can do without is taken back
    for number, value in enumerate(home):
        straight = [*best[:number], float(value), *best[number + 1 :]]
        if chain.margin(straight).singular >= least:
            best = straight
    return tuple(best)
