"""Tops of user-defined part types: surface heights on a grid, flat spots for the cup, box and height.

The part stands as modelled, or with another side up. A grid samples its collision shapes from above; a mesh counts as
its convex hull, as in contacts.
"""

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model.arm_looks import CUP, CUP_FACE_RADIUS
from cellwright.cell.model.own_models import PartGeometry
from cellwright.engine.shapes import Role, Shape, Touch, Visuals, add_shape, bounds
from cellwright.util.pose import Pose, Quaternion, Vector3

MAX_TILT = math.radians(5.0)
"""Maximum tilt [rad] of a flat surface."""

Heights = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GRID_CELLS, _MIN_CELL = 220, 0.0005  # cells of the grid along the longer side; their minimum size [m]
_CYLINDER_SIDES = 64  # sides of the prism that stands for a cylinder
LEVEL = 0.001
"""Maximum difference in height [m] between a spot and surfaces that are level with it."""
CLEARANCE = CUP.size[0] + 0.002
"""Minimum distance [m] of a spot from anything higher: room for the cup, which is widest behind its face."""
_QUARTER = math.pi / 2
_ROLL_AND_PITCH = (0.0, 0.0), (math.pi, 0.0), (0.0, _QUARTER), (0.0, -_QUARTER), (-_QUARTER, 0.0), (_QUARTER, 0.0)
TURNS = tuple(Pose.from_rpy((0.0, 0.0, 0.0), (*angles, 0.0)) for angles in _ROLL_AND_PITCH)
"""part_T_top for each side up: z, -z, x, -x, y and -y of the part's frame; z of the top's frame is up."""
_MAX_SPOTS = 8
_AWARD = 0.02  # [m] a flat spot of a larger radius is no better
_PENALTY = 0.3  # of the distance to the centre of mass, against the radius


class Grid:
    """Grid of square cells over the floor plan of a box with these corners [m].

    Attributes:
        x: middles of the columns, shape (1, columns) [m].
        y: middles of the rows, shape (rows, 1) [m].
        cell: edge of a cell [m].
    """

    def __init__(self, lower: NDArray[np.float64], upper: NDArray[np.float64]) -> None:
        size = (upper - lower)[:2]
        self.cell = max(_MIN_CELL, float(size.max()) / _GRID_CELLS)
        self.shape = rows, columns = tuple(max(1, math.ceil(length / self.cell)) for length in size[::-1])
        middle = (lower + upper) / 2
        self.x = middle[0] + self.cell * (np.arange(columns) - (columns - 1) / 2)[np.newaxis, :]
        self.y = middle[1] + self.cell * (np.arange(rows) - (rows - 1) / 2)[:, np.newaxis]


def _hull(model: Any, geom: int) -> NDArray[np.float64]:
    """Return the triangles of a mesh's convex hull in the part's frame [m], shape (n, 3, 3)."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    graph = model.mesh_graph[int(model.mesh_graphadr[mesh]) :]
    vertices, faces = int(graph[0]), int(graph[1])
    # after the addresses, the vertices and their neighbours
    begin = 2 + 3 * vertices + 3 * faces
    numbers = np.array(graph[begin : begin + 3 * faces], np.int64).reshape(-1, 3)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    corners = np.array(model.mesh_vert[first + numbers], np.float64)
    turned: NDArray[np.float64] = corners @ rotation.reshape(3, 3).T + model.geom_pos[geom]
    return turned


def _raster(grid: Grid, triangles: NDArray[np.float64]) -> tuple[Heights, Mask]:
    """Return the height [m] of a convex surface over each cell, -inf beside it, and a mask of its flat cells."""
    heights, is_flat = np.full(grid.shape, -np.inf), np.zeros(grid.shape, bool)
    x0, y0 = float(grid.x[0, 0]), float(grid.y[0, 0])
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    for corners, normal, length in zip(triangles, normals, lengths, strict=True):
        if normal[2] <= 1e-6 * length:
            continue  # faces down or sideways
        first = np.floor((corners[:, :2].min(axis=0) - (x0, y0)) / grid.cell).astype(int)
        last = np.ceil((corners[:, :2].max(axis=0) - (x0, y0)) / grid.cell).astype(int)
        rows, columns = slice(max(first[1], 0), last[1] + 1), slice(max(first[0], 0), last[0] + 1)
        dx, dy = grid.x[:, columns] - corners[0, 0], grid.y[rows] - corners[0, 1]
        (ax, ay, _), (bx, by, _) = corners[1] - corners[0], corners[2] - corners[0]
        # Barycentric coordinates of the cell's middle, seen from above. The normal's z is twice the projected area.
        along_a, along_b = (dx * by - dy * bx) / normal[2], (dy * ax - dx * ay) / normal[2]
        is_inside = (along_a >= -1e-9) & (along_b >= -1e-9) & (along_a + along_b <= 1 + 1e-9)
        surface = np.where(is_inside, corners[0, 2] - (normal[0] * dx + normal[1] * dy) / normal[2], -np.inf)
        is_higher = surface > heights[rows, columns]
        heights[rows, columns][is_higher] = surface[is_higher]
        is_flat[rows, columns][is_higher] = normal[2] >= math.cos(MAX_TILT) * length
    return heights, is_flat


def _analytic(grid: Grid, shape: Shape) -> tuple[Heights, Mask]:
    """Return the height [m] of a simple shape over each cell, -inf beside it, and a mask of its flat cells."""
    radius, half = shape.size[0], shape.size[1]
    match shape.kind:
        case "box":
            axes = np.vstack([np.eye(3), -np.eye(3)])
            return _prism(grid, shape.pose, axes, np.array([*shape.size, *shape.size]))
        case "sphere":
            return _ball(grid, shape.pose.position, radius)
        case "capsule":
            ends = [_ball(grid, shape.pose.transform((0.0, 0.0, end)), radius) for end in (-half, half)]
            return _highest([*ends, _round(grid, shape.pose, radius, half)])
        case _:
            return _round(grid, shape.pose, radius, half)


def _round(grid: Grid, pose: Pose, radius: float, half: float) -> tuple[Heights, Mask]:
    """Approximate a cylinder by a prism around it."""
    turns = np.arange(_CYLINDER_SIDES) * 2 * math.pi / _CYLINDER_SIDES
    sides = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(_CYLINDER_SIDES)])
    return _prism(
        grid, pose, np.vstack([sides, [[0, 0, 1], [0, 0, -1]]]), np.array([radius] * _CYLINDER_SIDES + [half, half])
    )


def _prism(grid: Grid, pose: Pose, normals: NDArray[np.float64], offsets: NDArray[np.float64]) -> tuple[Heights, Mask]:
    """Return height and flatness of a convex polyhedron.

    Its planes are given in its own frame, by outward normals, shape (n, 3), and distances from its middle [m].
    """
    rotation = _rotation(pose)
    px, py, pz = pose.position
    leave, enter = np.full(grid.shape, np.inf), np.full(grid.shape, -np.inf)
    top_slope = np.zeros(grid.shape)
    is_beside = np.zeros(grid.shape, bool)
    # A vertical line is in a convex body between the highest plane that it enters by and the lowest that it leaves by.
    for (nx, ny, nz), offset in zip(normals @ rotation.T, offsets, strict=True):
        room = offset - nx * (grid.x - px) - ny * (grid.y - py)
        if abs(nz) < 1e-9:
            is_beside |= room < 0.0
            continue
        height = room / nz
        if nz > 0:
            top_slope = np.where(height < leave, nz, top_slope)
            leave = np.minimum(leave, height)
        else:
            enter = np.maximum(enter, height)
    is_there = ~is_beside & (enter <= leave)
    return np.where(is_there, pz + leave, -np.inf), is_there & (top_slope >= math.cos(MAX_TILT))


def _rotation(pose: Pose) -> NDArray[np.float64]:
    """Return the rotation of a pose as a matrix, shape (3, 3)."""
    return np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T


def _ball(grid: Grid, centre: Vector3, radius: float) -> tuple[Heights, Mask]:
    aside = np.hypot(grid.x - centre[0], grid.y - centre[1])
    up = np.sqrt(np.maximum(radius**2 - aside**2, 0.0))
    return np.where(aside <= radius, centre[2] + up, -np.inf), aside <= radius * math.sin(MAX_TILT)


def _highest(surfaces: list[tuple[Heights, Mask]]) -> tuple[Heights, Mask]:
    heights, is_flat = surfaces[0]
    for surface, flat in surfaces[1:]:
        is_flat = np.where(surface > heights, flat, is_flat)
        heights = np.maximum(heights, surface)
    return heights, is_flat


@dataclass(frozen=True, slots=True)
class FlatSpot:
    """Place on the top that the cup can stand on: its middle, in the frame of the top [m].

    `radius` is that of the largest flat and level disc around it [m], at most that of the cup's face.
    """

    position: Vector3
    radius: float


@dataclass(frozen=True, slots=True)
class PartTop:
    """Top view of a part type with one of its sides up, in a frame that has the part's origin and z up.

    Attributes:
        turn: part_T_top: rotation of this frame in the part's (w, x, y, z).
        centre_of_mass: [m].
        lower: corner of its box with the minimum coordinates [m].
        upper: corner with the maximum coordinates [m].
        radius: radius of the circle around the middle of the box that contains its floor plan [m].
        spots: flat spots, one for each height that has any, the best first.
    """

    turn: Quaternion
    centre_of_mass: Vector3
    lower: Vector3
    upper: Vector3
    radius: float
    spots: tuple[FlatSpot, ...]


def part_tops(form: PartGeometry) -> tuple[PartTop, ...]:
    """Return the top of a part of this form for each of `TURNS`."""
    spec = mujoco.MjSpec()
    form.add_meshes(spec, Visuals())
    body = spec.worldbody.add_body(name="part")
    for shape in form.touched:
        add_shape(body, shape, Role.SOLID, Touch.PART, mass=form.mass)
    model = spec.compile()
    return tuple(_top(form, model, turn) for turn in TURNS)


def _top(form: PartGeometry, model: Any, part_T_top: Pose) -> PartTop:
    """Return the top of one side; `model` has a geom for each collision shape, in their order."""
    top_T_part = part_T_top.inverse()
    shapes = [shape.moved(top_T_part) for shape in form.touched]
    rotation = _rotation(top_T_part)
    hulls = {geom: _hull(model, geom) @ rotation.T for geom, shape in enumerate(shapes) if shape.kind == "mesh"}
    corners = [hulls[geom].reshape(-1, 3) if geom in hulls else bounds((shape,)) for geom, shape in enumerate(shapes)]
    boxes = np.array([(np.min(each, axis=0), np.max(each, axis=0)) for each in corners])
    lower, upper = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    grid = Grid(lower, upper)
    heights, is_flat = _highest(
        [_raster(grid, hulls[geom]) if geom in hulls else _analytic(grid, each) for geom, each in enumerate(shapes)]
    )
    middle = (lower + upper) / 2
    far = np.hypot(grid.x - middle[0], grid.y - middle[1])[np.isfinite(heights)].max(initial=0.0) + grid.cell / 2
    centre = top_T_part.transform(_vector3(model.body_ipos[1]))
    spots = _spots(grid, heights, is_flat, centre)
    return PartTop(part_T_top.quaternion, centre, _vector3(lower), _vector3(upper), float(far), spots)


def _spots(grid: Grid, heights: Heights, is_flat: Mask, centre: Vector3) -> tuple[FlatSpot, ...]:
    """Return the best spot at each height that has a flat surface, the best of all first."""
    aside = np.hypot(grid.x - centre[0], grid.y - centre[1])
    rated: list[tuple[float, FlatSpot]] = []
    left = is_flat.copy()
    for _ in range(_MAX_SPOTS):
        if not left.any():
            break
        level = _commonest(heights[left])
        is_level = is_flat & (np.abs(heights - level) <= LEVEL)
        left &= ~is_level
        is_higher = heights > level + LEVEL
        room = _distance_to(~is_level, grid.cell, CUP_FACE_RADIUS, beyond=True)
        is_free = is_level & (_distance_to(is_higher, grid.cell, CLEARANCE, beyond=False) >= CLEARANCE)
        if is_free.any():
            value = np.where(is_free, np.minimum(room, _AWARD) - _PENALTY * aside, -np.inf)
            row, column = np.unravel_index(int(value.argmax()), value.shape)
            place = (float(grid.x[0, column]), float(grid.y[row, 0]), float(heights[row, column]))
            rated.append((float(value[row, column]), FlatSpot(place, float(room[row, column]))))
    return tuple(spot for _, spot in sorted(rated, key=lambda each: -each[0]))


def _commonest(heights: Heights) -> float:
    """Return the most common height [m], to within `LEVEL`."""
    steps, counts = np.unique(np.round(heights / LEVEL).astype(np.int64), return_counts=True)
    step = steps[counts.argmax()]
    return float(np.median(heights[np.round(heights / LEVEL).astype(np.int64) == step]))


def _distance_to(mask: Mask, cell: float, limit: float, *, beyond: bool) -> Heights:
    """Return the distance [m] from the middle of each cell to the edge of the nearest cell in a mask.

    It is at most `limit`, which is about 100 cells: squares are kept in 16 bits. With `beyond`, everything outside of
    the grid is in the mask.
    """
    if not (mask.any() or beyond):
        return np.full(mask.shape, limit)
    rows, columns = mask.shape
    reach = math.ceil(limit / cell) + 1
    padded = np.pad(mask, [(reach, reach), (1, 1)], constant_values=beyond)
    places = np.arange(columns + 2, dtype=np.int16)
    before = np.maximum.accumulate(np.where(padded, places, -reach), axis=1)
    behind = np.minimum.accumulate(np.where(padded, places, columns + reach)[:, ::-1], axis=1)[:, ::-1]
    along = np.minimum(np.minimum(places - before, behind - places), reach)[:, 1:-1].astype(np.int16) ** 2
    nearest = along[reach : reach + rows].copy()
    for step in range(1, reach):
        for first in (reach - step, reach + step):
            np.minimum(nearest, along[first : first + rows] + np.int16(step**2), out=nearest)
    return np.asarray(np.clip((np.sqrt(nearest, dtype=np.float64) - 0.5) * cell, 0.0, limit))


def _vector3(values: Any) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
