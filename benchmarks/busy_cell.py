"""A busy cell that another engine can load as well: parts in bins, parts on the running belt, the arm swinging.

The types of parts, and those of the belt a metre apart, are as in the competition's finals, where a part came every
five seconds. The arm swings over the bins and touches nothing.
"""

from __future__ import annotations

from cellwright.cell.cell import Cell
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.trial.trial import CellSettings, Part, Trial
from cellwright.config.ur10 import INITIAL_POSITIONS
from cellwright.engine.clock import NANOSECONDS
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.util.pose import Pose

TYPES = ("gear_part", "disk_part", "gasket_part", "piston_rod_part")
BELT_PARTS = 8
"""Number of parts on the whole belt."""
ON_BELT = "belt|"
"""Prefix of the names of parts that ride on the belt."""
BETWEEN = 1.0
"""Distance of parts on the belt [m]."""

_SWING = (0.8, 0.6, 0.25, 0.25, 0.5, 0.4, 0.8)  # amplitude of each joint's swing [m, then rad]
_DROP = 0.0005  # initial height of parts above their surface [m]
_FIRST = 7.9  # world y [m] of the first part on the belt; its end is at -4.1
_BELT_X = 1.21


def busy_cell(count: int, rate: int, seconds: int, riding: int = BELT_PARTS) -> Cell:
    """Return a cell at its first step, its belt running and its arm in motion.

    Args:
        count: number of parts in the bins, at most 72.
        rate: steps per second [Hz].
        seconds: duration of the arm's swings; after 24 s the first parts are at the end of the belt.
        riding: number of parts on the belt, at most 8.
    """
    parts = (*_in_bins(count), *on_belt(riding))
    return at_work(Trial("busy", has_arm=True, bin_parts=parts, settings=CellSettings(timestep=(1, rate))), seconds)


def at_work(trial: Trial, seconds: int) -> Cell:
    """Return the cell of a trial at its first step, its belt running and its arm swinging for some seconds."""
    cell = Cell(trial, servo="precise")
    cell.conveyors["belt"].set_power(100.0)
    assert cell.arm is not None
    cell.arm.command(swings(seconds))
    return cell


def swings(seconds: int) -> JointTrajectory:
    """Return a trajectory from the arm's first posture to one side, then to and fro, one second for each swing."""
    first = [INITIAL_POSITIONS[name] for name in ARM_JOINTS]
    points = []
    for number in range(seconds):
        side = 1.0 if number % 2 else -1.0
        positions = [middle + side * swing for middle, swing in zip(first, _SWING, strict=True)]
        points.append(TrajectoryPoint(positions, [0.0] * len(first), (), (number + 1) * NANOSECONDS))
    return JointTrajectory(ARM_JOINTS, points)


def _in_bins(count: int) -> list[Part]:
    """Return parts in rows of three, one bin after the other, so that no bin has only one type."""
    parts = []
    for number in range(count):
        x, y = gear2017().bins[number % 8].centre
        row, column = divmod(number // 8, 3)
        kind = TYPES[(number + number // 8) % len(TYPES)]
        shift = 0.05 if kind == "piston_rod_part" else 0.0  # its origin is at one end of it
        place = (x + 0.2 * (row - 1), y + 0.2 * (column - 1) - shift, gear2017().bins[0].surface + _DROP)
        parts.append(Part(f"bin|{kind}_{number + 1}", kind, Pose(place)))
    return parts


def on_belt(count: int, between: float = BETWEEN) -> list[Part]:
    """Return parts on the belt, some distance [m] apart; the first one is farthest from its end."""
    parts = []
    for number in range(count):
        kind = TYPES[number % len(TYPES)]
        place = (_BELT_X, _FIRST - between * number, gear2017().belts[0].surface + _DROP)
        parts.append(Part(f"{ON_BELT}{kind}_{number + 1}", kind, Pose(place)))
    return parts
