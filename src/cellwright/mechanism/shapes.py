"""Shapes of robots in the engine: their builder, contacts that are left out, and the floor below them."""

from collections.abc import Iterable
from itertools import combinations, product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from cellwright.config.models.meshes import is_flat, read_mesh, read_surfaces
from cellwright.config.models.model import Colour, ModelShape
from cellwright.config.robot.model import RobotModel
from cellwright.engine import colours
from cellwright.engine.shapes import GEOM_TYPES, Mesh, add_mesh
from cellwright.util.pose import IDENTITY_QUATERNION, Pose, Vector3

Pair = tuple[str, str]

FLOOR = "floor"
"""Name of the floor's geom."""
DEFAULT_COLOUR = (0.62, 0.64, 0.67, 1.0)
"""Colour of shapes without one."""
MIN_HALF_LENGTH = 1e-4
"""Minimum half length of a shape [m]: the engine takes no thinner one."""
_VISUAL_GROUP = 2  # group of visual geoms
_WHOLE = -1  # in place of the number of a mesh's surface
_BOX_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def joined_pairs(robot: RobotModel, moved: frozenset[str], touched: frozenset[str]) -> list[Pair]:
    """Return pairs of `touched` links that are joined, by one `moved` joint or by any number of other joints.

    They never touch: their shapes overlap there by design. A joint is `moved` if it moves in the engine.
    """
    group_of = {robot.root: 0}
    groups: list[list[str]] = [[robot.root]]
    neighbours: list[tuple[int, int]] = []
    for joint in robot.joints:
        parent = group_of[joint.parent]
        # Links without a moving joint between them are one rigid group; a moving joint makes two groups neighbours.
        if joint.name in moved:
            neighbours.append((parent, len(groups)))
            group_of[joint.child] = len(groups)
            groups.append([joint.child])
        else:
            group_of[joint.child] = parent
            groups[parent].append(joint.child)
    solid = [[link for link in group if link in touched] for group in groups]
    inside = [pair for group in solid for pair in combinations(group, 2)]
    return inside + [pair for one, other in neighbours for pair in product(solid[one], solid[other])]


def overlapping_pairs(model: mujoco.MjModel, data: mujoco.MjData) -> list[Pair]:
    """Return pairs of bodies that overlap in the posture of `data`, each once.

    If they overlap in the initial posture, their shapes are too large, and would push each other apart for ever.
    """
    mujoco.mj_fwdPosition(model, data)
    found = {
        (min(bodies), max(bodies))
        for contact in data.contact[: data.ncon]
        if contact.dist < 0 and (bodies := [int(model.geom_bodyid[geom]) for geom in contact.geom])
    }
    return [(model.body(one).name, model.body(other).name) for one, other in sorted(found)]


def exclude_contacts(spec: Any, pairs: list[Pair]) -> None:
    """Exclude contacts between pairs of bodies."""
    for one, other in pairs:
        spec.add_exclude(bodyname1=one, bodyname2=other)


def add_floor(spec: Any) -> None:
    """Add an infinite floor at height 0, until `put_floor_under` moves it."""
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),  # a plane of size 0 is infinite
        rgba=colours.FLOOR,
        group=_VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )


def put_floor_under(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Move the floor to the lowest visible point of the robot, in the posture of `data`."""
    corners = visible_corners(model, data)
    if len(corners):
        floor = model.geom(FLOOR).id
        model.geom_pos[floor, 2] = corners[:, 2].min()
        # Without this the engine uses the world's height.
        model.geom_sameframe[floor] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE


def kinematics_of(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Return poses of bodies and shapes in the posture of `data`, which is only read; only its `qpos` matters."""
    still = mujoco.MjData(model)
    still.qpos[:], still.mocap_pos[:], still.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(model, still)
    return still


def visible_corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return corners (n, 3) [m] of the boxes around all visible shapes, in the world; without the floor.

    A box is aligned with the axes of its shape. `data` is only read; only its `qpos` matters.
    """
    still = kinematics_of(model, data)
    visible = np.flatnonzero((model.geom_group <= _VISUAL_GROUP) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    middles, halves = model.geom_aabb[visible, :3], model.geom_aabb[visible, 3:]
    local = middles[:, None, :] + halves[:, None, :] * _BOX_CORNERS
    turned = np.einsum("gij,gkj->gki", still.geom_xmat[visible].reshape(-1, 3, 3), local)
    corners: np.ndarray[Any, np.dtype[np.float64]] = (turned + still.geom_xpos[visible][:, None, :]).reshape(-1, 3)
    return corners


class ShapeBuilder:
    """Builder of the shapes of bodies; a mesh that many links use is loaded once.

    If links cannot touch each other (`is_touched` is false), shapes for contact alone are left out; if they are not
    drawn (`is_seen` is false), shapes that are only seen. The colours of a mesh file count before that of its shape, as
    in RViz.
    """

    def __init__(self, spec: Any, *, is_touched: bool, is_seen: bool) -> None:
        self._spec = spec
        self._is_touched, self._is_seen = is_touched, is_seen
        self._files: dict[Path, Mesh] = {}
        self._names: dict[tuple[Path, Vector3, int], str] = {}

    def add(self, body: Any, shape: ModelShape) -> bool:
        """Add a shape without mass to a body; return True if it is one for contact."""
        is_touched, is_seen = shape.is_touched and self._is_touched, shape.is_seen
        if is_seen and self._is_seen and self._add_coloured(body, shape):
            # what remains is the contact
            is_seen = False
        if not (is_touched or (is_seen and self._is_seen)):
            return False
        if shape.mesh is not None:
            geom = self._add_mesh(body, shape, shape.mesh, is_touched=is_touched)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, 0.0, 0.0)}.get(shape.kind, (x, y / 2, 0.0))
            size = tuple(max(half, MIN_HALF_LENGTH) for half in halves)
            geom = body.add_geom(type=GEOM_TYPES[shape.kind], size=size, **pose_arguments(shape.pose))
        _finish(geom, shape.colour, is_touched=is_touched, is_seen=is_seen)
        return is_touched

    def _add_coloured(self, body: Any, shape: ModelShape) -> bool:
        """Add the surfaces of a mesh whose file gives colours; return False if it gives none."""
        surfaces = read_surfaces(shape.mesh) if shape.mesh is not None else ()
        if shape.mesh is None or all(surface.colour is None for surface in surfaces):
            return False
        for number, surface in enumerate(surfaces):
            mesh = _scaled((surface.vertices, surface.triangles), shape.size)
            geom = self._mesh_geom(body, shape, (shape.mesh, shape.size, number), mesh)
            _finish(geom, surface.colour or shape.colour, is_touched=False, is_seen=True)
        return True

    def extent(self, shapes: Iterable[ModelShape]) -> list[float]:
        """Return edge lengths (3) [m] of the box around the shapes for contact, along the link's axes, or 0."""
        corners = [corner for shape in shapes if shape.is_touched for corner in self._corners(shape)]
        edges: list[float] = np.ptp(corners or [(0.0, 0.0, 0.0)], axis=0).tolist()
        return edges

    def _corners(self, shape: ModelShape) -> list[Vector3]:
        """Return corners [m] of the box around a shape, in the frame of its link."""
        if shape.mesh is not None:
            vertices, _ = self._read(shape.mesh, shape.size)
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, x, x), "cylinder": (x, x, y / 2)}
            upper = np.array(halves.get(shape.kind, (x, x, x + y / 2)))
            lower = -upper
        return [shape.pose.transform((x, y, z)) for x, y, z in product(*zip(lower, upper, strict=True))]

    def _add_mesh(self, body: Any, shape: ModelShape, path: Path, *, is_touched: bool) -> Any:
        vertices, triangles = self._read(path, shape.size)
        if len(vertices) < 4 or (is_touched and is_flat(vertices)):
            # the engine finds no hull around it: its box replaces it
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
            x, y, z = ((lower + upper) / 2).tolist()
            halves = np.maximum((upper - lower) / 2, MIN_HALF_LENGTH)
            at = shape.pose @ Pose((x, y, z))
            return body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=halves, **pose_arguments(at))
        return self._mesh_geom(body, shape, (path, shape.size, _WHOLE), (vertices, triangles))

    def _mesh_geom(self, body: Any, shape: ModelShape, key: tuple[Path, Vector3, int], mesh: Mesh) -> Any:
        if key not in self._names:
            self._names[key] = f"mesh {len(self._names)} {key[0].name}"
            add_mesh(self._spec, self._names[key], mesh)
        return body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=self._names[key], **pose_arguments(shape.pose))

    def _read(self, path: Path, scale: Vector3) -> Mesh:
        """Read a mesh [m], scaled to its shape."""
        if path not in self._files:
            self._files[path] = read_mesh(path)
        return _scaled(self._files[path], scale)


def _scaled(mesh: Mesh, scale: Vector3) -> Mesh:
    """Return a scaled mesh; the outside of a mirrored one stays outside."""
    vertices, triangles = mesh
    return vertices * scale, triangles if np.prod(scale) > 0 else triangles[:, ::-1]


def _finish(geom: Any, colour: Colour | None, *, is_touched: bool, is_seen: bool) -> None:
    geom.rgba = colour or DEFAULT_COLOUR
    geom.contype = geom.conaffinity = int(is_touched)
    geom.group = 2 if is_seen else 3
    geom.mass = 0.0


def pose_arguments(pose: Pose) -> dict[str, Any]:
    """Return a pose as arguments of the engine's specification."""
    return {"pos": pose.position, "quat": pose.quaternion if pose.quaternion != IDENTITY_QUATERNION else (1, 0, 0, 0)}
