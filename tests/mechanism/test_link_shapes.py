"""Shapes of links: hulls as they are, meshes in pieces, and primitives in place of all that a link touches with."""

from pathlib import Path

import numpy as np
import pytest

from cellwright.config.models.meshes import Triangles, read_mesh
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel
from cellwright.mechanism import convex_pieces
from cellwright.mechanism.link_shapes import link_shapes, with_collision_shapes
from cellwright.robot.model import build_robot
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.model.robots import one_link
from tests.config.models.dae_files import two_colours

BOX = ModelShape("box", (0.1, 0.1, 0.4))
ROD = ModelShape("capsule", (0.05, 0.3, 0.0))
PIECES = CollisionShapes("pieces")


@pytest.fixture
def cube(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModelShape:
    """Return a mesh for contact and for the picture; its pieces are two halves."""

    def divide(_path: Path, mesh: Triangles, _threshold: float) -> list[Triangles]:
        vertices, triangles = mesh
        return [(vertices * (0.5, 1, 1) + (shift, 0, 0), triangles) for shift in (0.0, 1.0)]

    monkeypatch.setattr(convex_pieces, "_divide", divide)
    monkeypatch.setattr(convex_pieces, "version", lambda _name: "1.0")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "cube.dae"
    path.write_text(two_colours())
    return ModelShape("mesh", (2.0, 1.0, 1.0), Pose((0.0, 0.0, 3.0)), mesh=path)


def test_hulls_are_the_shapes_as_they_are(cube: ModelShape) -> None:
    assert link_shapes(Link("a", shapes=(BOX, cube)), CollisionShapes()) == (BOX, cube)


def test_pieces_stand_in_for_the_contact_of_a_mesh_alone(cube: ModelShape) -> None:
    box, seen, *pieces = link_shapes(Link("a", shapes=(BOX, cube)), PIECES)
    assert box == BOX
    assert (seen.mesh, seen.size, seen.is_touched, seen.is_seen) == (cube.mesh, cube.size, False, True)
    assert [(shape.pose, shape.size, shape.is_touched, shape.is_seen) for shape in pieces] == [
        (cube.pose, (1.0, 1.0, 1.0), True, False)
    ] * 2
    spans = [np.ptp(read_mesh(shape.mesh)[0], axis=0).tolist() for shape in pieces if shape.mesh]
    assert spans == [[1.0, 1.0, 1.0]] * 2


def test_mesh_that_is_only_seen_or_flat_has_no_pieces(cube: ModelShape, tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n")
    flat = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=tmp_path / "flat.obj")
    seen = ModelShape("mesh", (1.0, 1.0, 1.0), is_touched=False, mesh=cube.mesh)
    assert link_shapes(Link("a", shapes=(flat, seen)), PIECES) == (flat, seen)


def test_engine_has_a_contact_shape_for_each_piece(cube: ModelShape) -> None:
    (_, *pieces) = link_shapes(Link("a", shapes=(cube,)), PIECES)
    model = build_robot(one_link(*pieces), self_collision=True).stepping
    assert sorted(model.geom_pos[:, 0].tolist()) == pytest.approx([0.5, 1.5])


def test_primitives_replace_all_contact_of_their_link(cube: ModelShape) -> None:
    touched = ModelShape("box", (1.0, 1.0, 1.0), is_seen=False)
    robot = RobotModel(
        "arm",
        "base",
        {"base": Link("base", shapes=(BOX,)), "tip": Link("tip", shapes=(touched, cube))},
        (Joint("j", JointType.FIXED, "base", "tip"),),
    )
    found = with_collision_shapes(robot, CollisionShapes(primitives={"tip": (ROD,), "base": ()}))
    assert [(shape.kind, shape.is_touched) for shape in found.links["base"].shapes] == [("box", False)]
    assert [(shape.kind, shape.is_seen) for shape in found.links["tip"].shapes] == [("mesh", True), ("capsule", False)]
    assert [shape.is_touched for shape in found.links["tip"].shapes] == [False, True]
    with pytest.raises(UsageError, match="the robot has no link 'tap'"):
        with_collision_shapes(robot, CollisionShapes(primitives={"tap": (ROD,)}))
