"""Layout of the cell of the 2017 competition.

Figures: the world template and models of the competition (positions in m, world frame; yaw in rad).
"""

import math
from collections.abc import Iterator
from functools import cache
from itertools import product

from cellwright.config.layout.layout import Belt, Bin, Carrier, KeyFrames, Layout
from cellwright.config.layout.surroundings import Block, FloorLine, Structure, View
from cellwright.util.pose import Pose

_BIN_YAW = 1.5708
"""Yaw of the bins' models, with the original's rounding."""

_WORKCELL = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 1.57 - math.pi / 2))
"""Frame of posts and bars: the yaw of the original's workcell is 1.57, a little less than a right angle."""
_THICK, _LINE = 0.05, 0.08
"""Edge of posts and bars, and width of a line on the floor [m]."""

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
            Bin(
                f"bin{n}",
                Pose((x, y, 0.0)),
                Pose.from_rpy((x, y, 0.0), (0.0, 0.0, _BIN_YAW)),
                open=("+x", "-x"),
                gap=0.0175,
            )
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
        shelf=Pose((1.0, -40.0, 0.0)),
        structure=(*_portals(), *_fence()),
        floor_lines=(
            *(each for side in (1.0, -1.0) for each in _station_lines(side)),
            FloorLine(Pose((-1.75, 0.0, 0.0)), (_LINE, 8.6)),
            FloorLine(Pose((2.35, 3.0, 0.0)), (_LINE, 16.0)),
        ),
        views=(
            View("overview", (-4.4, -3.1, 3.3), (0.42, -0.12, 0.62), math.radians(46)),
            View("bins", (-2.35, -0.17, 2.45), (-0.52, -0.17, 0.62), math.radians(50)),
            View("agv1", (-1.3, 2.25, 1.9), (0.3, 3.15, 0.72), math.radians(37)),
            View("agv2", (-1.3, -2.25, 1.9), (0.3, -3.15, 0.72), math.radians(37)),
            View("belt", (0.3, -2.7, 2.35), (1.12, 0.9, 0.8), math.radians(52)),
        ),
    )


def _portals() -> Iterator[Structure]:
    """Yield the two portals over the bins. Each is a flat body: the arm is first tested against its bounding box."""
    for number, x in enumerate((-1.08, -0.3143), 1):
        bar = Block(Pose((0.0, -0.25, 2.0)), (_THICK, 3.5, _THICK))
        posts = (Block(Pose((0.0, y, 0.9875)), (_THICK, _THICK, 1.975)) for y in (-2.0, 1.5))
        yield Structure(f"camera_frame_{number}", _WORKCELL @ Pose((x, 0.0, 0.0)), (bar, *posts))


def _fence() -> Iterator[Structure]:
    """Yield the fence along the conveyor, and the beam over it, with the bars between the two."""
    bar = Block(Pose((0.0, 0.0, 0.95)), (_THICK, 10.0, _THICK))
    posts = (Block(Pose((0.0, float(y), 1.5)), (_THICK, _THICK, 3.0)) for y in range(-5, 6))
    yield Structure("conveyor_frame", _WORKCELL @ Pose((1.7, 0.0, 0.0)), (bar, *posts))
    beam = Block(Pose(), (_THICK, 10.0, _THICK))
    between = tuple(Block(Pose((0.245, y, 0.0)), (0.54, _THICK, _THICK)) for y in (-5.0, 0.0, 5.0))
    yield Structure("conveyor_beam", _WORKCELL @ Pose((1.21, 0.0, 3.0)), (beam,), between)


def _station_lines(side: float) -> Iterator[FloorLine]:
    """Yield the lines around the station of the AGV at one end of the rail."""
    yield FloorLine(Pose((0.3, 2.45 * side, 0.0)), (2.3, _LINE))
    yield FloorLine(Pose((0.3, 4.15 * side, 0.0)), (2.3, _LINE))
    yield FloorLine(Pose((1.41, 3.3 * side, 0.0)), (_LINE, 1.78))


def _mirrored(frames: KeyFrames) -> KeyFrames:
    return tuple((time, x, -y) for time, x, y in frames)
