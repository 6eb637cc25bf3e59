"""Shapes: their bounding boxes, and their contacts."""

import itertools
import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.shapes import Role, Shape, ShapeKind, Touch, add_shape, bounds, box, capsule, cylinder, mesh
from cellwright.util.pose import Pose

GREY = (0.5, 0.5, 0.5, 1.0)
LENGTHS = st.floats(0.01, 1.0)
ANGLES = st.floats(-math.pi, math.pi)
POSES = st.builds(Pose.from_rpy, st.tuples(*[st.floats(-2.0, 2.0)] * 3), st.tuples(ANGLES, ANGLES, ANGLES))


Points = np.ndarray[Any, np.dtype[np.float64]]


def surface_points(shape: Shape) -> Points:
    """Return many points of a shape's surface, in its own frame, including the extreme ones."""
    x, y, z = shape.size
    if shape.kind == "box":
        return np.array(list(itertools.product((-x, x), (-y, y), (-z, z))))
    is_round = shape.kind == "capsule"  # at its ends: those of a cylinder are the rim alone
    turn = np.linspace(0, 2 * math.pi, 181 if is_round else 721)
    lift = np.linspace(0, math.pi / 2, 91) if is_round else np.zeros(1)
    a, b, side = (each.ravel() for each in np.meshgrid(turn, lift, (-1.0, 1.0)))
    along = x * np.cos(b)
    return np.array([along * np.cos(a), along * np.sin(a), side * (y + x * np.sin(b))]).T


def placed(points: Points, pose: Pose) -> Points:
    """Transform points from the frame of a pose to its parent frame, all at once."""
    axes = np.array([pose.rotate((1.0, 0.0, 0.0)), pose.rotate((0.0, 1.0, 0.0)), pose.rotate((0.0, 0.0, 1.0))])
    moved: Points = points @ axes + np.array(pose.position)
    return moved


@given(st.sampled_from(["box", "cylinder", "capsule"]), st.tuples(LENGTHS, LENGTHS, LENGTHS), POSES)
def test_bounds_touch_the_shape_and_contain_it(kind: ShapeKind, size: tuple[float, float, float], pose: Pose) -> None:
    shape = Shape(kind, size, pose, GREY)
    points = placed(surface_points(shape), pose)
    lower, upper = bounds((shape,))
    assert points.min(axis=0) == pytest.approx(lower, abs=2e-3)
    assert points.max(axis=0) == pytest.approx(upper, abs=2e-3)
    assert (points.min(axis=0) >= np.array(lower) - 1e-9).all()
    assert (points.max(axis=0) <= np.array(upper) + 1e-9).all()


def test_bounds_of_several_shapes_contain_all() -> None:
    shapes = (box(2, 2, 2, Pose((1, 0, 0)), GREY), cylinder(0.5, 1, Pose((0, 3, 0)), GREY))
    assert bounds(shapes) == ((-0.5, -1.0, -1.0), (2.0, 3.5, 1.0))


def test_moved_shape_has_pose_of_its_frame() -> None:
    frame = Pose.from_rpy((1.0, 2.0, 3.0), (0.0, 0.0, math.pi / 2))
    moved = capsule(0.1, 1.0, Pose((1.0, 0.0, 0.0)), GREY).moved(frame)
    assert moved.pose.position == pytest.approx((1.0, 3.0, 3.0))
    assert moved.size == (0.1, 0.5, 0.0)


def touches(first: Touch, second: Touch) -> bool:
    """Return True if two overlapping boxes of these classes make a contact in the engine."""
    spec = mujoco.MjSpec()
    for number, touch in enumerate((first, second)):
        body = spec.worldbody.add_body(name=f"b{number}")
        body.add_freejoint()
        add_shape(body, box(1, 1, 1, Pose(), GREY, 1.0), Role.BOTH, touch, mass=1.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(data.ncon)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (Touch.PART, Touch.PART, True),
        (Touch.PART, Touch.FIXED, True),
        (Touch.PART, Touch.ROBOT, True),
        (Touch.ROBOT, Touch.FIXED, True),
        (Touch.ROBOT, Touch.ROBOT, False),
        (Touch.FIXED, Touch.FIXED, False),
        (Touch.NOTHING, Touch.PART, False),
    ],
)
def test_contact_depends_on_classes_of_both_shapes(first: Touch, second: Touch, expected: bool) -> None:
    assert touches(first, second) is expected
    assert touches(second, first) is expected


def test_unseen_shape_has_no_contacts() -> None:
    spec = mujoco.MjSpec()
    geom = add_shape(spec.worldbody, box(1, 2, 3, Pose(), GREY), Role.UNSEEN, Touch.PART, name="face")
    assert (geom.contype, geom.conaffinity, geom.group) == (0, 0, 4)
    assert list(geom.size) == [0.5, 1.0, 1.5]
    assert spec.compile().geom("face").id == 0


def test_mesh_shape_names_its_mesh() -> None:
    spec = mujoco.MjSpec()
    assert add_shape(spec.worldbody, mesh("gear", GREY), Role.BOTH).meshname == "gear"
