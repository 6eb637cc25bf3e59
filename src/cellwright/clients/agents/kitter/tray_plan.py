"""Where on the tray a part goes: where it was ordered, or else as near as the tray allows without touching others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from cellwright.clients.agents.kitter.part_figures import Disc, PartFigures
from cellwright.util.pose import Pose

HALF_X, HALF_Y = 0.25, 0.35
"""The tray's rims stand at these distances from its middle [m]."""

RIM_GAP = 0.012
"""How far from a rim a part is put down that could not go where it was ordered [m]."""

PART_GAP = 0.008
"""How far from another part it is put down then [m]."""

_STEP = 0.01
_TURNS = 16


@dataclass(frozen=True, slots=True)
class Place:
    """A place on the tray.

    Attributes:
        tray_T_part: where the part is to lie.
        is_ordered: whether that is the ordered pose.
    """

    tray_T_part: Pose
    is_ordered: bool

    @property
    def distance_text(self) -> str:
        """For the log."""
        return "as ordered" if self.is_ordered else "as near as there is room"


def find_place(
    kind: PartFigures,
    tray_T_goal: Pose,
    others: Sequence[Disc],
    is_reachable: Callable[[Pose], bool] = lambda _: True,
) -> Place | None:
    """Where to put a part.

    The ordered pose is taken if it keeps the part inside the rims and off the others, even narrowly. If not, places on
    a grid of 1 cm are looked at from the ordered one outwards, with the ordered yaw first and other yaws after it.

    Args:
        kind: the figures of its type.
        tray_T_goal: where it was ordered.
        others: what is taken by others on the tray, in the tray frame.
        is_reachable: whether the arm can put the part down there.

    Returns:
        None when there is no room at all.
    """
    goal = Pose.from_rpy((*tray_T_goal.position[:2], 0.0), (0.0, 0.0, tray_T_goal.yaw))
    if fits(kind.covers(goal), others, 0.0, 0.0) and is_reachable(goal):
        return Place(goal, is_ordered=True)
    for candidate in _candidates(goal):
        if fits(kind.covers(candidate), others, RIM_GAP, PART_GAP) and is_reachable(candidate):
            return Place(candidate, is_ordered=False)
    return None


def fits(part: Sequence[Disc], others: Sequence[Disc], rim_gap: float, part_gap: float) -> bool:
    """Whether a part lies inside the rims and beside the others, with gaps [m]. All discs in the tray frame."""
    inside = all(
        abs(disc.x) + disc.radius + rim_gap <= HALF_X and abs(disc.y) + disc.radius + rim_gap <= HALF_Y for disc in part
    )
    return inside and all(
        math.hypot(disc.x - other.x, disc.y - other.y) >= disc.radius + other.radius + part_gap
        for disc in part
        for other in others
    )


def _candidates(goal: Pose) -> Iterator[Pose]:
    """Poses all over the tray, nearest to the goal first; all places with the ordered yaw before other yaws."""
    x0, y0, _ = goal.position
    columns, rows = round(HALF_X / _STEP), round(HALF_Y / _STEP)
    places = sorted(
        ((_STEP * i, _STEP * j) for i in range(-columns, columns + 1) for j in range(-rows, rows + 1)),
        key=lambda place: (round(math.hypot(place[0] - x0, place[1] - y0), 6), place),
    )
    for turn in range(_TURNS):
        # to either side in turn: 0, 1, -1, 2, -2, ...
        steps = (turn + 1) // 2 * (1 if turn % 2 else -1)
        yaw = goal.yaw + steps * 2 * math.pi / _TURNS
        for x, y in places:
            yield Pose.from_rpy((x, y, 0.0), (0.0, 0.0, yaw))
