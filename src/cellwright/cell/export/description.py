"""Description of a whole cell in URDF: its arms as the cell publishes them, and all that they could hit as links."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, get_args
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

import numpy as np

from cellwright.cell.interface.parameters import add_form, add_joint, add_link, robot_description
from cellwright.cell.model.build import World
from cellwright.cell.model.solids import hull_of, solid_geoms
from cellwright.config.layout.arm_models import chain_in_engine
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import GEOM_TYPES, Colour, Mesh, Shape, ShapeKind
from cellwright.mechanism.link_shapes import with_collision_shapes
from cellwright.util.pose import Pose

_WORLD, _FLOOR = "world", "floor"
_FLOOR_MARGIN, _FLOOR_DEPTH = 3.0, 0.1  # [m]
_KINDS: Mapping[int, ShapeKind] = {int(GEOM_TYPES[kind]): kind for kind in get_args(ShapeKind)}
_NO_WORD = re.compile(r"\W+", re.ASCII)
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class CellDescription:
    """Description of a cell.

    Attributes:
        urdf: its text; meshes are files of a package.
        package: name of this package.
        meshes: contents of these files, by their paths in the package.
        bodies: names in the engine of what stands in the cell, by link.
    """

    urdf: str
    package: str
    meshes: Mapping[str, bytes]
    bodies: Mapping[str, str]


def cell_description(trial: Trial, world: World, package: str) -> CellDescription:
    """Return the description of a cell as a run begins: AGVs stand at their load points; parts are left out.

    The links of arms have the shapes that they touch with in the engine; the floor is a plate below all else.

    Args:
        trial: the trial.
        world: its model.
        package: name of the package that the meshes are in.

    Raises:
        ModelFileError: a mesh cannot be read.
        UsageError: convex pieces cannot be made.
    """
    robot = fromstring(robot_description(_with_touched_shapes(trial)))  # noqa: S314  # our own text
    meshes = dict(_packed_meshes(robot, package))
    model, data = world.model, world.initial_data()
    of_arms = {name for arm in trial.arms for name in chain_in_engine(arm, trial.arm_models).links}
    names, bodies = {each.attrib["name"] for tag in ("link", "joint") for each in robot.iter(tag)}, {}
    for body, geoms in groupby(solid_geoms(world), lambda geom: int(model.geom_bodyid[geom])):
        name = model.body(body).name
        if name in of_arms:
            continue
        link = _link_name(name, names)
        bodies[link] = name
        shapes: list[Shape] = []
        hulls: dict[str, Pose] = {}
        for geom in geoms:
            pose = _pose(model.geom_pos[geom], model.geom_quat[geom])
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind == "mesh":
                path = f"meshes/{link}_{len(hulls)}.stl"
                meshes[path] = _stl(hull_of(model, geom))
                hulls[f"package://{package}/{path}"] = pose
            elif kind is None:  # the floor is the only plane
                shapes.append(_floor(world, data))
            else:
                first, second, third = model.geom_size[geom].tolist()
                if kind == "capsule":  # one shape, a little longer, where an exact one would be three
                    kind, second = "cylinder", second + first
                shapes.append(Shape(kind, (first, second, third), pose, _colour(model, geom)))
        element = add_link(robot, link, solid=shapes)
        for file, pose in hulls.items():
            for tag in ("visual", "collision"):
                add_form(SubElement(element, tag), "mesh", {"filename": file}, pose)
        add_joint(robot, "fixed", f"{link}_joint", _WORLD, link, _pose(data.xpos[body], data.xquat[body]))
    indent(robot)
    urdf = '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"
    return CellDescription(urdf, package, meshes, bodies)


def _with_touched_shapes(trial: Trial) -> Trial:
    """Return a trial in which arms are described with the shapes that they touch with."""
    models = {
        name: replace(model, robot=with_collision_shapes(model.robot, model.collision), collision=CollisionShapes())
        for name, model in trial.arm_models.items()
    }
    return replace(trial, arm_models=models)


def _packed_meshes(robot: Element, package: str) -> Iterator[tuple[str, bytes]]:
    """Make mesh files of a robot files of the package; yield path and content of each."""
    paths: dict[str, str] = {}
    for mesh in robot.iter("mesh"):
        file = mesh.attrib["filename"]
        if file not in paths:
            source = Path(unquote(urlsplit(file).path))
            paths[file] = f"meshes/{len(paths)}_{_NO_WORD.sub('_', source.stem)}{source.suffix.lower()}"
            yield paths[file], source.read_bytes()
        mesh.attrib["filename"] = f"package://{package}/{paths[file]}"


def _link_name(body: str, taken: set[str]) -> str:
    """Return the name of a body's link, in letters, digits and underscores, and note it as taken."""
    plain = _FLOOR if body == _WORLD else _NO_WORD.sub("_", body.removeprefix("furniture|"))
    name, number = plain, 2
    while taken & {name, f"{name}_joint"}:
        name, number = f"{plain}_{number}", number + 1
    taken.add(name)
    return name


def _floor(world: World, data: Any) -> Shape:
    """Return a plate in place of the endless floor, wider than the cell."""
    model = world.model
    geoms = [geom for geom in solid_geoms(world) if int(model.geom_type[geom]) in _KINDS]
    places, radii = data.geom_xpos[geoms, :2], model.geom_rbound[geoms, None]
    lower, upper = (places - radii).min(axis=0) - _FLOOR_MARGIN, (places + radii).max(axis=0) + _FLOOR_MARGIN
    (x, y), (half_x, half_y) = ((lower + upper) / 2).tolist(), ((upper - lower) / 2).tolist()
    half = _FLOOR_DEPTH / 2
    return Shape("box", (half_x, half_y, half), Pose((x, y, -half)), _colour(model, model.geom(_FLOOR).id))


def _colour(model: Any, geom: int) -> Colour:
    red, green, blue, opacity = model.geom_rgba[geom].tolist()
    return (red, green, blue, opacity)


def _stl(mesh: Mesh) -> bytes:
    """Return a mesh as the content of a binary STL file."""
    vertices, triangles = mesh
    facets = np.zeros(len(triangles), _FACET)
    corners = facets["corners"] = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets["normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return b"\0" * 80 + len(facets).to_bytes(4, "little") + facets.tobytes()


def _pose(position: Any, quaternion: Any) -> Pose:
    x, y, z = (float(number) for number in position)
    w, i, j, k = (float(number) for number in quaternion)
    return Pose((x, y, z), (w, i, j, k))
