"""What the agent knows of the parts, against the parts themselves."""

import math

import pytest

from cellwright.agents.kitter.part_figures import PART_TYPES, box_outline, figures
from cellwright.errors import UnknownNameError
from cellwright.pose import Pose
from cellwright.world.parts import PART_TYPES as BUILT
from cellwright.world.parts import part_type
from cellwright.world.shapes import bounds


def test_it_knows_every_type_that_can_be_built() -> None:
    assert frozenset(BUILT) == PART_TYPES


@pytest.mark.parametrize("name", sorted(PART_TYPES))
def test_the_outline_covers_the_part(name: str) -> None:
    lower, upper = part_type(name).box
    discs = figures(name).outline
    assert min(disc.x - disc.radius for disc in discs) <= lower[0] + 1e-4
    assert max(disc.x + disc.radius for disc in discs) >= upper[0] - 1e-4
    assert min(disc.y - disc.radius for disc in discs) <= lower[1] + 1e-4
    assert max(disc.y + disc.radius for disc in discs) >= upper[1] - 1e-4


@pytest.mark.parametrize("name", sorted(PART_TYPES))
def test_the_cup_meets_something_solid_there(name: str) -> None:
    figure = figures(name)
    tops = []
    for shape in part_type(name).solid:
        lower, upper = bounds((shape,))
        nearest = [min(max(at, low), high) for at, low, high in zip(figure.grip, lower[:2], upper[:2], strict=True)]
        if math.dist(nearest, figure.grip) < 0.038:  # radius of the cup's face
            tops.append(upper[2])
    assert max(tops) == pytest.approx(figure.top, abs=0.0006)


def test_an_outline_moves_with_the_part() -> None:
    (far,) = [
        disc
        for disc in figures("gasket_part").covers(Pose.from_rpy((1.0, 2.0, 0.0), (0.0, 0.0, math.pi / 2)))
        if disc.y > 2.05
    ]
    assert (far.x, far.y) == pytest.approx((1.0, 2.067))


def test_discs_cover_the_corners_of_a_box() -> None:
    discs = box_outline(0.06, 0.13, 0.03, 0.03, 0.9)
    for u in (-0.03, 0.03):
        for v in (-0.065, 0.065):
            x = 0.03 + math.cos(0.9) * u - math.sin(0.9) * v
            y = 0.03 + math.sin(0.9) * u + math.cos(0.9) * v
            assert any(math.dist((x, y), (disc.x, disc.y)) <= disc.radius + 1e-9 for disc in discs)


def test_an_unknown_type() -> None:
    with pytest.raises(UnknownNameError, match="gear_prat"):
        figures("gear_prat")
