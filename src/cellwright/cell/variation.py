"""Variation: the same trial as it would be in another cell on another day, so that winning is not memory.

What is varied, within `Bounds`, and drawn from which child of the seed:

| what | child |
|---|---|
| place and turn of each part in a bin | `vary/PART`, a child for each part |
| friction, one coefficient for the whole cell | `vary/friction` |
| when the belt's first parts come | `vary/belt` |
| when in each 0.1 s the gripper looks for parts | `vary/gripper` |

The sensors' noise follows the cell's own seed and needs no variation. The same trial and seed give the same variation
in any process; a trial that is not varied is not touched.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellwright.config.layout import (
    BIN_CENTRES,
    BIN_PART_HEIGHT,
    BIN_WIDTH,
    PART_FOOTPRINTS,
    REFERENCE_FRAMES,
    Footprint,
    footprint,
)
from cellwright.config.trial.trial import Circumstances, Part, Trial
from cellwright.engine.random_streams import generator
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose, quaternion_from_rpy, quaternion_product

CLEARANCE = 0.0005
"""How near [m] a part may be put to another, or to the edge of its bin's floor, if it was not nearer before."""

TRIES = 64
"""How often a place is drawn for a part before it stays where it is."""

GRIPPER_PERIOD = 0.1
"""The gripper looks for parts so often [s]."""

_HEIGHT = 0.3
"""A part in a bin is at most so far [m] above or below the origin of the bin's grid."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """How far a variation goes. Everything is drawn uniformly.

    Attributes:
        shift: how far a part in a bin is moved along x, and along y, to either side [m].
        turn: how far it is turned about the vertical to either side [rad].
        least_friction: least coefficient of dry friction.
        most_friction: most of it.
        belt_delay: how much later the belt's parts begin to come, at most, in mean distances between two of them.
        gripper_phase: how much of the gripper's 0.1 s its first look is spread over, 0 to 1.

    Raises:
        UsageError: a bound that cannot be.
    """

    shift: float = 0.006
    turn: float = 0.2
    least_friction: float = 0.6
    most_friction: float = 1.0
    belt_delay: float = 1.0
    gripper_phase: float = 1.0

    def __post_init__(self) -> None:
        limits = {
            "shift": (self.shift, 0.0, BIN_WIDTH / 2),
            "turn": (self.turn, 0.0, math.pi),
            "least_friction": (self.least_friction, 0.01, self.most_friction),
            "most_friction": (self.most_friction, self.least_friction, 10.0),
            "belt_delay": (self.belt_delay, 0.0, 1000.0),
            "gripper_phase": (self.gripper_phase, 0.0, 1.0),
        }
        for name, (value, lower, upper) in limits.items():
            if not lower <= value <= upper:
                raise UsageError(f"{name} of a variation must be from {lower:g} to {upper:g}, not {value:g}")


USUAL = Bounds()
"""The bounds of `--vary`."""


def vary(trial: Trial, seed: int, bounds: Bounds = USUAL) -> Trial:
    """A variation of a trial: other places of the parts that lie in bins, and other circumstances.

    Args:
        trial: the trial as it is written.
        seed: root of all chance.
        bounds: how far to go.

    Raises:
        UnknownNameError: a part stands in a frame that does not exist.
    """
    parts = vary_parts((*trial.bin_parts, *trial.extra_parts), seed, bounds)
    count = len(trial.bin_parts)
    interval = max((part.time for part in trial.belt_parts), default=0.0) / max(len(trial.belt_parts), 1)
    circumstances = Circumstances(
        friction=float(generator(seed, "vary/friction").uniform(bounds.least_friction, bounds.most_friction)),
        belt_delay=float(generator(seed, "vary/belt").uniform(0.0, 1.0)) * bounds.belt_delay * interval,
        gripper_phase=float(generator(seed, "vary/gripper").uniform(0.0, 1.0)) * bounds.gripper_phase * GRIPPER_PERIOD,
        seed=seed,
    )
    return replace(trial, bin_parts=parts[:count], extra_parts=parts[count:], circumstances=circumstances)


def vary_parts(parts: Sequence[Part], seed: int, bounds: Bounds = USUAL) -> tuple[Part, ...]:
    """Move those parts that lie in bins, each within its bounds.

    One after the other: a place is drawn anew while the part would come nearer than `CLEARANCE` to another part, those
    included that have not been moved yet, or to the edge of its bin's floor. Where it was nearer from the beginning, it
    may stay as near. A part that finds no place in `TRIES` draws stays where it is, and so does one of unknown size.
    """
    places = [_world_pose(part) for part in parts]
    before = [footprint(part.type, place) for part, place in zip(parts, places, strict=True)]
    now = list(before)
    varied = list(parts)
    for index, part in enumerate(parts):
        centre = _bin_centre(places[index])
        if centre is None or part.type not in PART_FOOTPRINTS:
            continue
        chance = generator(seed, f"vary/{part.name}")
        for _ in range(TRIES):
            place = _moved(places[index], chance, bounds)
            covered = footprint(part.type, place)
            if _has_room(index, covered, centre, before, now):
                now[index] = covered
                varied[index] = replace(part, pose=REFERENCE_FRAMES[part.frame].inverse() @ place)
                break
    return tuple(varied)


def _has_room(
    index: int, covered: Footprint, centre: tuple[float, float], before: Sequence[Footprint], now: Sequence[Footprint]
) -> bool:
    half = BIN_WIDTH / 2
    if covered.margin(centre, half) < min(CLEARANCE, before[index].margin(centre, half)):
        return False
    for other, footprint_now in enumerate(now):
        if other != index:
            gap = covered.gap(footprint_now, CLEARANCE)
            if gap < CLEARANCE and gap < before[index].gap(before[other], CLEARANCE):
                return False
    return True


def _moved(place: Pose, chance: np.random.Generator, bounds: Bounds) -> Pose:
    dx, dy, yaw = (float(share) for share in chance.uniform(-1.0, 1.0, 3))
    x, y, z = place.position
    turned = quaternion_product(quaternion_from_rpy(0.0, 0.0, yaw * bounds.turn), place.quaternion)
    return Pose((x + dx * bounds.shift, y + dy * bounds.shift, z), turned)


def _world_pose(part: Part) -> Pose:
    if part.frame not in REFERENCE_FRAMES:
        raise UnknownNameError("frame", part.frame, REFERENCE_FRAMES)
    return REFERENCE_FRAMES[part.frame] @ part.pose


def _bin_centre(place: Pose) -> tuple[float, float] | None:
    """Centre of the bin that a part lies in; None when it lies in none."""
    x, y, z = place.position
    for centre in BIN_CENTRES.values():
        if max(abs(x - centre[0]), abs(y - centre[1])) <= BIN_WIDTH / 2 and abs(z - BIN_PART_HEIGHT) <= _HEIGHT:
            return centre
    return None
