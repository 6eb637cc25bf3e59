"""What a part type of somebody's own offers to a cup from above: its box, its height, and the flat spots of its top.

The part stands as it was modelled, or with another side up. Its touched shapes are looked at from above on a grid; a
mesh counts as its convex hull, as it is touched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.arm_looks import CUP, CUP_FACE_RADIUS
from cellwright.cell.model.own_models import Form
from cellwright.cell.model.top_surface import Heights, Mask, Surface, surface_of
from cellwright.engine.geometry.shapes import Role, Touch, add_shape
from cellwright.util.pose import Pose, Quaternion, Vector3

LEVEL = 0.001
"""What lies within this height [m] of a spot is level with it."""

CLEARANCE = CUP.size[0] + 0.002
"""What is higher than a spot stays this far [m] from it: beside the cup, which is widest behind its face."""

_QUARTER = math.pi / 2

TURNS = tuple(
    Pose.from_rpy((0.0, 0.0, 0.0), (roll, pitch, 0.0))
    for roll, pitch in (
        (0.0, 0.0),
        (math.pi, 0.0),
        (0.0, _QUARTER),
        (0.0, -_QUARTER),
        (-_QUARTER, 0.0),
        (_QUARTER, 0.0),
    )
)
"""part_T_top for each side that may be up: z, -z, x, -x, y and -y of the part's frame; z of the top's frame is up."""

_MOST_SPOTS = 8
_AWARD = 0.02  # [m] a flat spot of a larger radius is no better
_PENALTY = 0.3  # of the distance to the centre of mass, against the radius


@dataclass(frozen=True, slots=True)
class FlatSpot:
    """A place on the top that the cup can stand on.

    Attributes:
        position: its middle, in the frame of the top [m].
        radius: of the largest flat and level disc about it [m], at most that of the cup's face.
    """

    position: Vector3
    radius: float


@dataclass(frozen=True, slots=True)
class PartTop:
    """A part type as it looks from above with one of its sides up, in a frame that has its origin and z up.

    Attributes:
        turn: part_T_top: this frame in the part's (w, x, y, z).
        centre_of_mass: [m].
        lower: corner of its box of least coordinates [m].
        upper: corner of largest coordinates [m].
        radius: of the circle about the middle of the box that holds its floor plan [m].
        spots: flat spots, one for each height at which there are any, the best first.
    """

    turn: Quaternion
    centre_of_mass: Vector3
    lower: Vector3
    upper: Vector3
    radius: float
    spots: tuple[FlatSpot, ...]


def part_tops(form: Form) -> tuple[PartTop, ...]:
    """What a part of this form offers to a cup from above, for each of `TURNS`."""
    model = _compiled(form)
    return tuple(_top(form, model, turn) for turn in TURNS)


def _top(form: Form, model: Any, part_T_top: Pose) -> PartTop:
    top_T_part = part_T_top.inverse()
    seen = surface_of(form.touched, model, top_T_part)
    covered = np.isfinite(seen.heights)
    middle = (seen.lower + seen.upper) / 2
    far = np.hypot(seen.grid.x - middle[0], seen.grid.y - middle[1])[covered].max(initial=0.0) + seen.grid.cell / 2
    centre = top_T_part.transform(_vector(model.body_ipos[1]))
    box = _vector(seen.lower), _vector(seen.upper)
    return PartTop(part_T_top.quaternion, centre, *box, float(far), _spots(seen, centre))


def _compiled(form: Form) -> Any:
    """A model of the part alone, its geoms in the order of the touched shapes."""
    spec = mujoco.MjSpec()
    form.add_meshes(spec)
    body = spec.worldbody.add_body(name="part")
    for shape in form.touched:
        add_shape(body, shape, Role.SOLID, Touch.PART, mass=form.mass)
    return spec.compile()


def _spots(seen: Surface, centre: Vector3) -> tuple[FlatSpot, ...]:
    """The best spot at each height at which there is something flat, the best of all first."""
    grid, heights, is_flat = seen.grid, seen.heights, seen.is_flat
    aside = np.hypot(grid.x - centre[0], grid.y - centre[1])
    found: list[tuple[float, FlatSpot]] = []
    left = is_flat.copy()
    for _ in range(_MOST_SPOTS):
        if not left.any():
            break
        level = _commonest(heights[left])
        is_level = is_flat & (np.abs(heights - level) <= LEVEL)
        left &= ~is_level
        is_higher = heights > level + LEVEL
        room = np.minimum(_distance_to(~is_level, grid.cell), CUP_FACE_RADIUS)
        is_free = is_level & (_distance_to(is_higher, grid.cell, beyond=np.inf) >= CLEARANCE)
        if is_free.any():
            value = np.where(is_free, np.minimum(room, _AWARD) - _PENALTY * aside, -np.inf)
            row, column = np.unravel_index(int(value.argmax()), value.shape)
            place = (float(grid.x[row, column]), float(grid.y[row, column]), float(heights[row, column]))
            found.append((float(value[row, column]), FlatSpot(place, float(room[row, column]))))
    return tuple(spot for _, spot in sorted(found, key=lambda each: -each[0]))


def _commonest(heights: Heights) -> float:
    """The height [m] that most of these have, to within `LEVEL`."""
    steps, counts = np.unique(np.round(heights / LEVEL).astype(np.int64), return_counts=True)
    step = steps[counts.argmax()]
    return float(np.median(heights[np.round(heights / LEVEL).astype(np.int64) == step]))


def _distance_to(mask: Mask, cell: float, beyond: float = 0.5) -> Heights:
    """Distance [m] from the middle of each cell to the edge of the nearest one in a mask.

    Args:
        mask: the cells.
        cell: their edge [m].
        beyond: what lies outside of the grid begins so many cells behind the middles of the outermost ones; infinite
            for nothing.
    """
    rows, columns = mask.shape
    along = np.where(mask, 0.0, np.inf)
    steps = np.arange(columns, dtype=float)
    for column in range(1, columns):
        along[:, column] = np.minimum(along[:, column], along[:, column - 1] + 1.0)
    for column in range(columns - 2, -1, -1):
        along[:, column] = np.minimum(along[:, column], along[:, column + 1] + 1.0)
    squares = along**2
    nearest = np.empty_like(squares)
    offsets = np.arange(rows, dtype=float)
    for row in range(rows):
        nearest[row] = (squares + (offsets[:, np.newaxis] - row) ** 2).min(axis=0)
    found = np.maximum(np.sqrt(nearest) - 0.5, 0.0)
    if math.isfinite(beyond):
        edge_x = np.minimum(steps, columns - 1 - steps) + beyond
        edge_y = np.minimum(offsets, rows - 1 - offsets) + beyond
        found = np.minimum(found, np.minimum(edge_x[np.newaxis, :], edge_y[:, np.newaxis]))
    return np.asarray(found * cell)


def _vector(values: Any) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
