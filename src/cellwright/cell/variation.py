"""Variation: the same trial as in another cell on another day, so that an agent cannot win by memory.

These quantities vary within `Bounds`, each drawn from its own child of the seed:

- place and turn of each part in a bin: `vary/PART`, a child for each part
- friction, one coefficient for the whole cell: `vary/friction`
- delay of the belt's first parts: `vary/belt`
- phase of the gripper's checks within 0.1 s: `vary/gripper`

The sensors' noise follows the cell's own seed and needs no variation. The same trial and seed give the same variation
in any process. A trial without variation stays untouched.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellwright.config.footprints import PART_FOOTPRINTS, Footprint, footprint
from cellwright.config.layout.layout import Bin, Layout
from cellwright.config.trial.trial import Circumstances, Part, Trial
from cellwright.engine.random_streams import generator
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose, quaternion_from_rpy, quaternion_product

CLEARANCE = 0.0005
"""Minimum gap [m] between a moved part and another, or the edge of its bin's floor, if it was not nearer before."""

TRIES = 64
"""Maximum number of draws for the place of a part; after that it stays where it is."""

GRIPPER_PERIOD = 0.1
"""Period [s] of the gripper's checks for parts."""

MAX_SHIFT = 0.3
"""Maximum bound of a shift [m]."""

_HEIGHT = 0.3
"""Maximum height [m] of a part in a bin above or below the origin of the bin's grid."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of a variation. Everything is drawn uniformly.

    Attributes:
        shift: maximum shift of a part in a bin along either edge of the bin, to either side [m].
        turn: maximum turn of it about the vertical to either side [rad].
        min_friction: minimum coefficient of dry friction.
        max_friction: maximum coefficient of dry friction.
        belt_delay: maximum delay of the belt's first parts, in mean distances between two of them.
        gripper_phase: share of the gripper's 0.1 s over which its first check is spread, 0 to 1.

    Raises:
        UsageError: a bound is out of range.
    """

    shift: float = 0.006
    turn: float = 0.2
    min_friction: float = 0.6
    max_friction: float = 1.0
    belt_delay: float = 1.0
    gripper_phase: float = 1.0

    def __post_init__(self) -> None:
        limits = {
            "shift": (self.shift, 0.0, MAX_SHIFT),
            "turn": (self.turn, 0.0, math.pi),
            "min_friction": (self.min_friction, 0.01, self.max_friction),
            "max_friction": (self.max_friction, self.min_friction, 10.0),
            "belt_delay": (self.belt_delay, 0.0, 1000.0),
            "gripper_phase": (self.gripper_phase, 0.0, 1.0),
        }
        for name, (value, lower, upper) in limits.items():
            if not lower <= value <= upper:
                raise UsageError(f"{name} of a variation must be from {lower:g} to {upper:g} (got {value:g})")


def vary(trial: Trial, seed: int, bounds: Bounds | None = None) -> Trial:
    """Return a variation of a trial: other places of the parts that lie in bins, and other circumstances.

    Args:
        trial: the trial as written.
        seed: root of all random streams.
        bounds: limits of the variation; those of `--vary` by default.

    Raises:
        UnknownNameError: a part stands in a frame that does not exist.
    """
    bounds = bounds or Bounds()
    parts = vary_parts((*trial.bin_parts, *trial.extra_parts), trial.layout, seed, bounds)
    count = len(trial.bin_parts)
    interval = max((part.time for part in trial.belt_parts), default=0.0) / max(len(trial.belt_parts), 1)
    circumstances = Circumstances(
        friction=float(generator(seed, "vary/friction").uniform(bounds.min_friction, bounds.max_friction)),
        belt_delay=float(generator(seed, "vary/belt").uniform(0.0, 1.0)) * bounds.belt_delay * interval,
        gripper_phase=float(generator(seed, "vary/gripper").uniform(0.0, 1.0)) * bounds.gripper_phase * GRIPPER_PERIOD,
        seed=seed,
    )
    return replace(trial, bin_parts=parts[:count], extra_parts=parts[count:], circumstances=circumstances)


def vary_parts(parts: Sequence[Part], layout: Layout, seed: int, bounds: Bounds | None = None) -> tuple[Part, ...]:
    """Move the parts that lie in bins, one after the other, each within its bounds.

    A place is drawn again while the part would come nearer than `CLEARANCE` to another part or to the edge of its bin's
    floor. The other parts include those that have not been moved yet. A part that was nearer from the beginning may
    stay as near. A part without a place after `TRIES` draws stays where it is, and so does one of unknown size.
    """
    bounds = bounds or Bounds()
    frames = layout.reference_frames
    places = [_world_pose(part, frames) for part in parts]
    before = [footprint(part.type, place) for part, place in zip(parts, places, strict=True)]
    now = list(before)
    varied = list(parts)
    for index, part in enumerate(parts):
        around = _bin_around(places[index], layout)
        if around is None or part.type not in PART_FOOTPRINTS:
            continue
        # Each part has a stream of its own: another part in the file changes nothing for this one.
        chance = generator(seed, f"vary/{part.name}")
        for _ in range(TRIES):
            place = _moved(places[index], around, chance, bounds)
            covered = footprint(part.type, place)
            if _has_room(index, covered, around, before, now):
                now[index] = covered
                varied[index] = replace(part, pose=frames[part.frame].inverse() @ place)
                break
    return tuple(varied)


def _has_room(
    index: int, covered: Footprint, around: Bin, before: Sequence[Footprint], now: Sequence[Footprint]
) -> bool:
    area = around.pose, around.size
    if covered.margin(*area) < min(CLEARANCE, before[index].margin(*area)):
        return False
    for other, footprint_now in enumerate(now):
        if other != index:
            # Two parts that lay closer as written may stay as close, but come no nearer.
            gap = covered.gap(footprint_now, CLEARANCE)
            if gap < CLEARANCE and gap < before[index].gap(before[other], CLEARANCE):
                return False
    return True


def _moved(place: Pose, around: Bin, chance: np.random.Generator, bounds: Bounds) -> Pose:
    """Return a place that is shifted along the edges of its bin, and turned."""
    dx, dy, yaw = (float(share) for share in chance.uniform(-1.0, 1.0, 3))
    dx, dy, _ = around.pose.rotate((dx * bounds.shift, dy * bounds.shift, 0.0))
    x, y, z = place.position
    turned = quaternion_product(quaternion_from_rpy(0.0, 0.0, yaw * bounds.turn), place.quaternion)
    return Pose((x + dx, y + dy, z), turned)


def _world_pose(part: Part, frames: Mapping[str, Pose]) -> Pose:
    if part.frame not in frames:
        raise UnknownNameError("frame", part.frame, frames)
    return frames[part.frame] @ part.pose


def _bin_around(place: Pose, layout: Layout) -> Bin | None:
    """Return the bin that a part lies in, or None if it lies in none."""
    x, y, z = place.position
    bins = (each for each in layout.bins if abs(z - each.grid_height) <= _HEIGHT and each.covers(x, y))
    return next(bins, None)
