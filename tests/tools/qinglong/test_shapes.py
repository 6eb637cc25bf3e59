"""Shapes of a drawing: each lies at the requested place."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cellwright.util.pose import Pose, Vector3
from tools.qinglong.drawing import DARK, SHELL, Shape, ball, block, capsule, cushion, rod

LENGTH = st.floats(-2.0, 2.0)
POINT = st.tuples(LENGTH, LENGTH, LENGTH)
ANGLE = st.floats(-3.0, 3.0)


@given(start=POINT, end=POINT)
def test_rod_goes_from_point_to_point(start: Vector3, end: Vector3) -> None:
    assume(math.dist(start, end) > 1e-3)
    made = rod(start, end, 0.1, DARK)
    half = made.size[1] / 2
    assert made.pose.transform((0.0, 0.0, -half)) == pytest.approx(start, abs=1e-9)
    assert made.pose.transform((0.0, 0.0, half)) == pytest.approx(end, abs=1e-9)
    assert (made.kind, made.size[0], made.colour) == ("cylinder", 0.1, DARK)


@given(centre=POINT, rpy=st.tuples(ANGLE, ANGLE, ANGLE), corner=POINT)
def test_mirrored_shape_has_every_point_on_other_side(centre: Vector3, rpy: Vector3, corner: Vector3) -> None:
    """A corner (x, y, z) of a box is the mirror image of its corner (x, -y, z)."""
    made = block(centre, (1.0, 1.0, 1.0), SHELL, rpy)
    x, y, z = made.pose.transform(corner)
    mirrored = made.mirrored().pose.transform((corner[0], -corner[1], corner[2]))
    assert mirrored == pytest.approx((x, -y, z), abs=1e-6)


@given(centre=POINT, at=POINT, rpy=st.tuples(ANGLE, ANGLE, ANGLE))
def test_shape_stays_in_place_when_its_frame_changes(centre: Vector3, at: Vector3, rpy: Vector3) -> None:
    frame = Pose.from_rpy(at, rpy)
    seen = ball(centre, 0.1, SHELL).seen_from(frame)
    assert (frame @ seen.pose).position == pytest.approx(centre, abs=1e-9)


def test_capsule_has_balls_at_its_ends() -> None:
    made = capsule((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.2, SHELL)
    assert [shape.kind for shape in made] == ["cylinder", "sphere", "sphere"]
    assert [shape.pose.position[2] for shape in made] == [0.5, 0.0, 1.0]


def test_cushion_has_requested_size_and_round_edges() -> None:
    centre, size, radius = (1.0, 2.0, 3.0), (0.4, 0.6, 0.8), 0.1
    made = cushion(centre, size, radius, SHELL)
    for axis in range(3):
        reach = max(abs(shape.pose.position[axis] - centre[axis]) + _half(shape, axis) for shape in made)
        assert reach == pytest.approx(size[axis] / 2)
    corner = [1.2, 2.3, 3.4]  # of the box around it: no point of the cushion is nearer than the round corner
    nearest = min(math.dist(shape.pose.position, corner) - radius for shape in made if shape.kind == "sphere")
    assert nearest == pytest.approx(radius * (math.sqrt(3) - 1))
    assert sum(shape.kind == "cylinder" for shape in made) == 12


def _half(shape: Shape, axis: int) -> float:
    """Return the extent of a shape along an axis of the world, if it lies along one."""
    if shape.kind == "box":
        return shape.size[axis] / 2
    if shape.kind == "sphere":
        return shape.size[0]
    along = abs(shape.pose.rotate((0.0, 0.0, 1.0))[axis])
    return shape.size[1] / 2 if along > 0.5 else shape.size[0]
