"""Choice of collision shapes: what is refused, and with which remedy."""

import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel
from cellwright.util.errors import UsageError

ROD = ModelShape("capsule", (0.05, 0.3, 0.0))
ROBOT = RobotModel(
    "arm", "base", {"base": Link("base"), "forearm": Link("forearm")}, (Joint("j", JointType.FIXED, "base", "forearm"),)
)


def test_hull_is_the_default() -> None:
    assert (CollisionShapes().kind, CollisionShapes().threshold) == ("hull", 0.05)


@pytest.mark.parametrize("threshold", [0.0, 0.009, 1.1, float("nan")])
def test_threshold_out_of_range_is_refused(threshold: float) -> None:
    with pytest.raises(UsageError, match=r"collision: threshold must be from 0\.01 to 1 \(got "):
        CollisionShapes("pieces", threshold)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (ModelShape("mesh", (1.0, 1.0, 1.0)), r"collision: arm: must be one of box, cylinder, .* \(got mesh\)"),
        (ModelShape("sphere", (0.0, 0.0, 0.0)), r"lengths of a sphere must be above 0 m \(got 0\)"),
        (ModelShape("box", (1.0, -1.0, 1.0)), r"lengths of a box must be above 0 m \(got 1 -1 1\)"),
        (ModelShape("capsule", (0.1, float("nan"), 0.0)), r"lengths of a capsule must be above 0 m \(got 0\.1 nan\)"),
    ],
)
def test_shape_that_is_no_primitive_or_has_no_size_is_refused(shape: ModelShape, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        CollisionShapes(primitives={"arm": (shape,)})


def test_unknown_link_is_refused_with_the_likeliest_name() -> None:
    CollisionShapes(primitives={"forearm": (ROD,)}).check(ROBOT)
    with pytest.raises(UsageError, match="collision: the robot has no link 'forarm'; did you mean forearm"):
        CollisionShapes(primitives={"forarm": (ROD,)}).check(ROBOT)
