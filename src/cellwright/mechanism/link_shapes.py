"""Shapes that a link touches with, as its arm's entry chooses them: hulls, convex pieces, or named primitives."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace

from cellwright.config.models.meshes import is_flat, read_mesh
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.model import Link, RobotModel
from cellwright.mechanism.convex_pieces import convex_pieces


def with_collision_shapes(
    robot: RobotModel, collision: CollisionShapes, variables: Mapping[str, str] = os.environ
) -> RobotModel:
    """Return a robot whose links touch with the chosen shapes, and look as before.

    Args:
        robot: the robot.
        collision: the choice.
        variables: the environment, for the cache of convex pieces.

    Raises:
        UsageError: the robot has no link of a name, or pieces cannot be made.
        ModelFileError: a mesh cannot be read.
    """
    collision.check(robot)
    links = {name: replace(link, shapes=link_shapes(link, collision, variables)) for name, link in robot.links.items()}
    return replace(robot, links=links)


def link_shapes(
    link: Link, collision: CollisionShapes, variables: Mapping[str, str] = os.environ
) -> tuple[ModelShape, ...]:
    """Return the shapes of a link: those that are seen as they are, and the chosen ones for contact.

    Args:
        link: the link.
        collision: the choice.
        variables: the environment, for the cache of convex pieces.

    Raises:
        UsageError: pieces cannot be made.
        ModelFileError: a mesh cannot be read.

    Example:
        >>> drawn = ModelShape("box", (0.1, 0.1, 0.4))
        >>> rod = ModelShape("capsule", (0.05, 0.3, 0.0))
        >>> found = link_shapes(Link("arm", shapes=(drawn,)), CollisionShapes(primitives={"arm": (rod,)}))
        >>> [(shape.kind, shape.is_seen, shape.is_touched) for shape in found]
        [('box', True, False), ('capsule', False, True)]
    """
    primitives = collision.primitives.get(link.name)
    if primitives is not None:
        seen = [replace(shape, is_touched=False) for shape in link.shapes if shape.is_seen]
        return (*seen, *(replace(shape, is_seen=False, is_touched=True) for shape in primitives))
    if collision.kind == "hull":
        return link.shapes
    return tuple(found for shape in link.shapes for found in _in_pieces(shape, collision.threshold, variables))


def _in_pieces(shape: ModelShape, threshold: float, variables: Mapping[str, str]) -> Iterator[ModelShape]:
    """Yield a shape, with a touched mesh in convex pieces; those are meshes in metres."""
    if shape.mesh is None or not shape.is_touched or is_flat(read_mesh(shape.mesh)[0] * shape.size):
        yield shape
        return
    if shape.is_seen:
        yield replace(shape, is_touched=False)
    for path in convex_pieces(shape.mesh, shape.size, threshold, variables):
        yield replace(shape, size=(1.0, 1.0, 1.0), mesh=path, is_seen=False)
