"""Guard of an arm that a person works: it takes no step by which the arm would come too near to the cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cellwright.clients.agents.kitter.clearance import Clearance, Obstacle
from cellwright.config.layout.arms import HOLDERS, Arm
from cellwright.config.ur10 import RAIL
from cellwright.motion.chain import Chain
from cellwright.motion.solver import Vector
from cellwright.util.pose import Pose

LEAST = 0.004
"""Least distance [m] of the arm to the cell, but for what its tool touches from above."""
PRESS = 0.003
"""Distance [m] by which the tool may be pressed into the cell."""
_AWAY = 1e-6
"""Distance [m] by which a step may come nearer where the arm is too near already: rounding."""


@dataclass(frozen=True)
class Figures:
    """Figures of an arm for its distances; attributes as of `ArmFigures`."""

    gripper: str
    home: Vector
    carriers: frozenset[str]


@dataclass(frozen=True)
class Standing:
    """Place of an arm, in the frame of its mount."""

    figures: Figures
    world_T_frame: Pose
    frame_T_base: Pose


class ArmGuard:
    """Guard of one arm, by the shapes that the cell describes; parts, loads and other arms are none of them.

    Args:
        solids: shapes by frame, as `Client.solids` returns them.
        chain: the arm from the frame of its mount, with its rail, as `Client.chains` returns it.
        arm: its entry in the layout.
        beside: all arms of the layout: those on one rail have one beam.
        home: a posture in which no link hits another [rad; m].
    """

    def __init__(
        self,
        solids: Mapping[str, Sequence[Mapping[str, Any]]],
        chain: Chain,
        arm: Arm,
        beside: Sequence[Arm],
        home: Sequence[float],
    ) -> None:
        carriers = frozenset().union(*(_carriers(each) for each in beside if each.pose == arm.pose))
        links = (arm.prefix + name.removeprefix(arm.frame_prefix) for name in chain.links)
        figures = Figures(_holder(arm), tuple(home), carriers.union(links))
        self._clearance = Clearance(solids, chain, Standing(figures, Pose(), arm.pose))

    def refusal(self, before: Sequence[float], after: Sequence[float]) -> str:
        """Return why a step is not taken; empty if it is free, or leads away from what the arm is too near to."""
        for touches, least in ((True, LEAST), (False, -PRESS)):
            found = self._clearance.obstacle([after], touches=touches, least=least)
            if found is None:
                continue
            was = self._clearance.obstacle([before], touches=touches, least=least)
            if was is None or found.distance < was.distance - _AWAY:
                return _text(found)
        return ""


def _text(found: Obstacle) -> str:
    return str(found) if found.distance >= 0.0 else f"{found.moving} would be pressed into {found.other}"


def _holder(arm: Arm) -> str:
    """Return the frame of the link that holds parts; it may touch what lies below."""
    return arm.frame_prefix + HOLDERS.get(arm.tool.kind, arm.tip)


def _carriers(arm: Arm) -> frozenset[str]:
    """Return the names of the bodies that carry an arm."""
    return frozenset({f"{arm.name}_{arm.mount.kind}", arm.prefix + RAIL})
