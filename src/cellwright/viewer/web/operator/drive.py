"""The base's buttons: what a press, repeated while it lasts, means in each mode of a robot's base."""

from __future__ import annotations

from cellwright.robot.base import Mode

RATE = 10.0
"""A button that is held says so this often [Hz]; the base keeps a speed for 0.2 s."""
SPEED, TURNING = 0.3, 0.6
"""How fast the base is to go [m/s] and to turn [rad/s]."""

DIRECTIONS = {
    "forward": (0.0, 1.0, 0.0),
    "back": (0.0, -1.0, 0.0),
    "left": (0.0, 0.0, 1.0),
    "right": (0.0, 0.0, -1.0),
    "turn left": (1.0, 0.0, 0.0),
    "turn right": (-1.0, 0.0, 0.0),
}
"""Turn, along x, along y: as a share of the speeds."""


def directions(mode: Mode) -> tuple[str, ...]:
    """The buttons that there are; the original's commands go along y only."""
    if mode is Mode.ORIGINAL:
        return ("left", "right", "turn left", "turn right")
    return tuple(DIRECTIONS)


def numbers(mode: Mode, direction: str) -> tuple[float, ...]:
    """The command for a button that is held; for modes that move at once, as much as is due until it says so again."""
    turn, x, y = DIRECTIONS[direction]
    share = 1.0 if mode is Mode.VELOCITY else 1.0 / RATE
    turn, x, y = turn * TURNING * share, x * SPEED * share, y * SPEED * share
    return (turn, y) if mode is Mode.ORIGINAL else (turn, x, y)
