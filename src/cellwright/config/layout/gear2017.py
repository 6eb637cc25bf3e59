"""Layout of the cell of the 2017 competition.

Figures: the world template and models of the competition (positions in m, world frame; yaw in rad).
"""

import math
from functools import cache
from itertools import product

from cellwright.config.layout.layout import Belt, Bin, Carrier, KeyFrames, Layout
from cellwright.util.pose import Pose

_BIN_YAW = 1.5708
"""Yaw of the bins' models, with the original's rounding."""

_WORKCELL_YAW = 1.57 - math.pi / 2
"""The yaw of the original's workcell is 1.57, a little less than a right angle."""

_OUT: KeyFrames = (
    ("0", 0.3, 3.3),
    ("1.5", -0.76, 3.3),
    ("3", -2.73, 3.3),
    ("4", -3.94, 3.6),
    ("5.3", -4.5, 4.4),
    ("6.5", -4.5, 5.3),
    ("7.7", -4.5, 6.3),
    ("9", -4.2, 8.0),
    ("10", -4.2, 8.3),
)
_BACK: KeyFrames = (
    ("0", -4.2, 8.3),
    ("2.6", -4.4, 6.4),
    ("3.8", -4.5, 5.2),
    ("5.4", -4.4, 4.1),
    ("6.8", -3.8, 3.5),
    ("7.9", -2.8, 3.3),
    ("9.4", -1.6, 3.3),
    ("12", 0.3, 3.3),
)


@cache
def gear2017() -> Layout:
    """Return the layout of 2017: eight bins, a belt along y, an AGV at either end of the arm's rail."""
    return Layout(
        frame=Pose(),
        bins=tuple(
            Bin(f"bin{n}", Pose((x, y, 0.0)), Pose.from_rpy((x, y, 0.0), (0.0, 0.0, _BIN_YAW)))
            for n, (x, y) in enumerate(product((-1.0, -0.3), (-1.33, -0.535, 0.23, 0.995)), start=1)
        ),
        belts=(
            Belt(
                name="belt",
                body="conveyor_belt",
                centre=Pose.from_rpy((1.21, 3.0, 0.8126), (0.0, 0.0, -math.pi / 2)),
                size=(14.62206, 0.65461, 0.18862),
                # ARIAC 2017, kMaxBeltLinVel
                speed=0.2,
                direction=(0.0, -1.0, 0.0),
                spawn=Pose.from_rpy((1.21, 5.0, 0.8126), (0.0, 0.0, -1.57079)),
                frame=Pose((1.24, 0.15, 0.91)),
                wall=Pose((1.2, -4.1, 1.41)),
            ),
        ),
        carriers=(
            Carrier(
                number=1,
                name="agv1",
                home=Pose.from_rpy((0.3, 3.3, 0.0), (0.0, 0.0, 3.14159)),
                tray_link="agv1::kit_tray_1::kit_tray_1::tray",
                tray_frame=Pose.from_rpy((0.3, 3.15, 0.75), (0.0, 0.0, 3.14159)),
                quality=Pose.from_rpy((0.3, 3.5, 1.5), (0.0, 1.574, -1.574)),
                out=_OUT,
                back=_BACK,
                colour=(0xE0 / 255, 0x76 / 255, 0x2B / 255, 1.0),
            ),
            Carrier(
                number=2,
                name="agv2",
                home=Pose.from_rpy((0.3, -3.3, 0.0)),
                tray_link="agv2::kit_tray_2::kit_tray_2::tray",
                tray_frame=Pose.from_rpy((0.3, -3.15, 0.75)),
                quality=Pose.from_rpy((0.3, -3.5, 1.5), (0.0, 1.574, 1.574)),
                out=_mirrored(_OUT),
                back=_mirrored(_BACK),
                colour=(0x2F / 255, 0x6F / 255, 0xB4 / 255, 1.0),
            ),
        ),
        rail=Pose((0.3, 0.0, 0.9)),
        workcell=Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, _WORKCELL_YAW)),
        shelf=Pose((1.0, -40.0, 0.0)),
    )


def _mirrored(frames: KeyFrames) -> KeyFrames:
    return tuple((time, x, -y) for time, x, y in frames)
