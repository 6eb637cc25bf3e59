"""Shapes of a scene as markers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import Marker, MarkerArray
from cellwright.recording.replay import exported
from cellwright.recording.replay.exported import Markers
from cellwright.rendering.scene import Mesh, Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.util.pose import Pose
from cellwright.viewer.web.meshes import surface
from tests.rendering.scene.scenes import small

WEDGE = Mesh(
    np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], np.float32),
    np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3)], np.int32),
)
SIZES = st.floats(0.01, 3.0)


def of(shape: SceneShape) -> list[Any]:
    """Return the markers of a scene with this shape on its second body."""
    return Markers(Scene("one", ("world", "cart"), (shape,), (WEDGE,))).message.markers


def reach(marker: Any) -> NDArray[np.float64]:
    """Return the minimum and maximum coordinates [m] of a marker without rotation."""
    place = marker.pose.position
    if marker.type == Marker.TRIANGLE_LIST:
        corners = np.array([(p.x, p.y, p.z) for p in marker.points])
    else:
        half = np.array((marker.scale.x, marker.scale.y, marker.scale.z)) / 2
        corners = np.stack([-half, half])
    corners = corners + np.array((place.x, place.y, place.z))
    found: NDArray[np.float64] = np.stack([corners.min(axis=0), corners.max(axis=0)])
    return found


@given(st.sampled_from(ShapeType), st.tuples(SIZES, SIZES, SIZES), st.tuples(SIZES, SIZES, SIZES))
def test_marker_has_size_of_shape_on_page(form: ShapeType, size: Any, position: Any) -> None:
    mesh = 0 if form is ShapeType.MESH else None
    shape = SceneShape(1, form, size, Pose(position), (1.0, 0.5, 0.0, 1.0), ShapeLayer.BOTH, mesh)
    reaches = np.stack([reach(each) for each in of(shape)])
    points = surface(shape, Scene("one", ("world", "cart"), (shape,), (WEDGE,))).points
    assert reaches[:, 0].min(axis=0) == pytest.approx(points.min(axis=0), abs=0.002)
    assert reaches[:, 1].max(axis=0) == pytest.approx(points.max(axis=0), abs=0.002)


@pytest.mark.parametrize("form", list(ShapeType))
def test_marker_has_orientation_and_colour_of_shape(form: ShapeType) -> None:
    pose = Pose.from_rpy((1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    mesh = 0 if form is ShapeType.MESH else None
    for marker in of(SceneShape(1, form, (0.1, 0.2, 0.3), pose, (1.0, 0.5, 0.25, 0.75), ShapeLayer.LOOKS, mesh)):
        turn, colour = marker.pose.orientation, marker.color
        assert (turn.w, turn.x, turn.y, turn.z) == pytest.approx(pose.quaternion)
        assert (colour.r, colour.g, colour.b, colour.a) == (1.0, 0.5, 0.25, 0.75)
        assert (marker.header.frame_id, marker.ns, marker.frame_locked) == ("cellwright/cart", "cart", True)
        assert (marker.action, marker.lifetime.sec, marker.lifetime.nanosec) == (Marker.ADD, 0, 0)


def test_capsule_ends_lie_along_its_axis() -> None:
    pose = Pose.from_rpy((1.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0))
    _, *ends = of(SceneShape(1, ShapeType.CAPSULE, (0.1, 0.5, 0.0), pose, (1.0, 1.0, 1.0, 1.0), ShapeLayer.BOTH))
    assert [each.pose.position.x for each in ends] == pytest.approx([0.5, 1.5])


def test_visual_shapes_have_markers_and_collision_shapes_have_none() -> None:
    scene = small()[2].scene
    found = Markers(scene).message.markers
    assert {(each.ns, each.header.frame_id) for each in found} == {
        ("world", "world"),
        ("hand", "cellwright/hand"),
        ("load", "cellwright/load"),
        ("ball", "cellwright/ball"),
    }
    assert [each.id for each in found] == list(range(len(found)))
    message = MarkerArray(found)
    assert TYPES.to_cdr(TYPES.from_cdr(TYPES.to_cdr(message), MarkerArray)) == TYPES.to_cdr(message)


def test_infinite_floor_has_finite_marker() -> None:
    (floor,) = of(SceneShape(0, ShapeType.PLANE, (0.0, 0.0, 0.1), Pose(), (1.0, 1.0, 1.0, 1.0), ShapeLayer.LOOKS))
    assert reach(floor)[:, :2].tolist() == [[-30.0, -30.0], [30.0, 30.0]]
    assert reach(floor)[1, 2] == pytest.approx(0.0)


def test_meshes_over_size_limit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exported, "MAX_CORNERS", 2 * WEDGE.faces.size)
    shape = SceneShape(1, ShapeType.MESH, (0.0, 0.0, 0.0), Pose(), (1.0, 1.0, 1.0, 1.0), ShapeLayer.BOTH, 0)
    found = Markers(Scene("many", ("world", "cart"), (shape,) * 3, (WEDGE,)))
    assert (len(found.message.markers), found.left_out) == (2, 1)
