"""Joined shapes: what is joined, what stays, and that the surface stays in its place."""

import numpy as np

from cellwright.rendering.scene import Scene
from cellwright.rendering.scene.joining import join_shapes
from cellwright.rendering.scene.scene import Mesh, SceneShape, ShapeLayer, ShapeType
from cellwright.util.pose import Pose

RED, BLUE, GLASS = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.5)


def box(body: int, colour: tuple[float, float, float, float] = RED, x: float = 0.1) -> SceneShape:
    return SceneShape(body, ShapeType.BOX, (0.02, 0.02, 0.02), Pose((x, 0.1, 0.0)), colour, ShapeLayer.BOTH)


def joined(*shapes: SceneShape, meshes: tuple[Mesh, ...] = ()) -> Scene:
    return join_shapes(Scene("", ("world", "a", "b"), shapes, meshes))


def test_join_shapes_of_one_body_and_colour_gives_one_mesh() -> None:
    scene = joined(box(1), box(1, x=0.2), box(1, BLUE))
    assert [(each.body, each.colour, each.form) for each in scene.shapes] == [
        (1, RED, ShapeType.MESH),
        (1, BLUE, ShapeType.MESH),
    ]
    points = scene.meshes[0].vertices
    np.testing.assert_allclose((points.min(axis=0), points.max(axis=0)), ((0.08, 0.08, -0.02), (0.22, 0.12, 0.02)))


def test_join_shapes_shares_equal_meshes_of_bodies() -> None:
    scene = joined(box(1), box(2, BLUE))
    assert [each.mesh for each in scene.shapes] == [0, 0]
    assert len(scene.meshes) == 1


def test_join_shapes_keeps_distant_static_shapes_apart() -> None:
    assert len(joined(box(0), box(0, x=0.3)).shapes) == 1
    assert len(joined(box(0), box(0, x=4.0)).shapes) == 2


def test_join_shapes_keeps_planes_and_translucent_shapes_and_drops_unseen_ones() -> None:
    plane = SceneShape(0, ShapeType.PLANE, (0.0, 0.0, 0.0), Pose(), RED, ShapeLayer.BOTH)
    touched = SceneShape(1, ShapeType.SPHERE, (0.1, 0.0, 0.0), Pose(), RED, ShapeLayer.TOUCH)
    scene = joined(plane, box(1, GLASS), touched)
    assert scene.shapes == (plane, box(1, GLASS))
    assert scene.meshes == ()


def test_join_shapes_turns_meshes_and_drops_unused_ones() -> None:
    unused = Mesh(np.zeros((3, 3), np.float32), np.array([(0, 1, 2)], np.int32))
    corner = Mesh(np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32), np.array([(0, 1, 2)], np.int32))
    pose = Pose((0.0, 0.0, 2.0), (0.0, 1.0, 0.0, 0.0))  # half a turn about x
    shape = SceneShape(1, ShapeType.MESH, (0.0, 0.0, 0.0), pose, RED, ShapeLayer.LOOKS, 1)
    scene = joined(shape, meshes=(unused, corner))
    (mesh,) = scene.meshes
    np.testing.assert_allclose(mesh.vertices, [(1, 0, 2), (0, -1, 2), (0, 0, 1)], atol=1e-6)
    np.testing.assert_array_equal(mesh.faces, corner.faces)
