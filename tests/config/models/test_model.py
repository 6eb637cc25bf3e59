"""Values of user-defined models."""

from cellwright.config.models.model import Furniture, ModelShape, UserModel, clipped_colour


def test_colour_is_clipped_to_its_range() -> None:
    assert clipped_colour([-1.0, 0.25, 1.5, 1.0]) == (0.0, 0.25, 1.0, 1.0)


def test_shape_is_touched_and_seen_by_default() -> None:
    shape = ModelShape("sphere", (0.1, 0.0, 0.0))
    assert (shape.is_touched, shape.is_seen, shape.colour, shape.mesh) == (True, True, None, None)
    assert Furniture("table", UserModel((shape,))).pose.position == (0.0, 0.0, 0.0)
