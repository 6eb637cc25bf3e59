import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.rendering.raycast import Hits, RayCaster
from cellwright.rendering.shading import SIDE as SQUARE
from cellwright.rendering.shading import disc_lamp, openness, sky
from tests.rendering.scenes import FLOOR, scene

SIDE = 20
KEY = disc_lamp((0, 0, 5), (0, 0, 0), 0.2)
SKY = sky((0, 0, 0), 8.0)


def patch(
    lamps: NDArray[np.float64], world: str, middle: tuple[float, float], size: float = 0.02
) -> NDArray[np.float32]:
    """Openness of the floor to lamps in a small square about `middle`, for SIDE x SIDE pixels from above."""
    caster = RayCaster(*scene(FLOOR + world))
    offset = (np.arange(SIDE) + 0.5) / SIDE * size - size / 2
    rows, columns = np.divmod(np.arange(SIDE * SIDE), SIDE)
    points = np.column_stack([middle[0] + offset[columns], middle[1] + offset[rows], np.zeros(SIDE * SIDE)])
    up = np.tile((0.0, 0.0, 1.0), (SIDE * SIDE, 1))
    hits = Hits(np.zeros(SIDE * SIDE, np.int32), np.full(SIDE * SIDE, 5.0), up)
    return openness(caster, lamps, hits, points, range(SIDE), SIDE)


def test_disc_lamps_fill_disc_and_face_target() -> None:
    lamp = disc_lamp((1, 2, 3), (4, 2, 3), 0.5)
    offsets = lamp - (1, 2, 3)
    distance = np.linalg.norm(offsets, axis=1)
    assert np.allclose(offsets[:, 0], 0, atol=1e-12)
    assert 0.4 < distance.max() <= 0.5
    assert np.median(distance) == pytest.approx(0.5 * 0.5**0.5, abs=0.02)
    assert lamp.mean(axis=0) == pytest.approx((1, 2, 3), abs=0.05)
    assert len(np.unique(lamp.round(9), axis=0)) == SQUARE**2


def test_sky_is_half_sphere() -> None:
    directions = (sky((1, 0, 0), 4.0) - (1, 0, 0)) / 4
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    assert (directions[:, 2] > 0).all()
    assert directions[:, 2].mean() == pytest.approx(0.5)
    assert directions[:, :2].mean(axis=0) == pytest.approx((0, 0), abs=0.05)
    assert len(np.unique(directions.round(9), axis=0)) == 25


@pytest.mark.parametrize("lamps", [KEY, SKY])
def test_empty_floor_is_fully_open(lamps: NDArray[np.float64]) -> None:
    assert (patch(lamps, "", (0, 0)) == 1).all()


def test_floor_beneath_slab_sees_no_lamp_and_little_sky() -> None:
    slab = '<geom type="box" size="2 2 .1" pos="0 0 .5" group="1"/>'
    assert (patch(KEY, slab, (0, 0)) == 0).all()
    assert patch(SKY, slab, (0, 0)).max() < 0.12


def test_wall_hides_half_of_sky() -> None:
    # light on a level floor from the half of the sky before a long high wall: exactly half, by symmetry
    wall = '<geom type="box" size=".1 50 50" pos=".11 0 50" group="1"/>'
    assert patch(SKY, wall, (0, 0)).mean() == pytest.approx(0.5, abs=0.08)


def test_shadow_edge_is_soft() -> None:
    # seen from a lamp 5 m up, an edge 2.5 m up and 0 aside falls on x = 0; the lamp's 0.2 m make 0.4 m of half shade
    slab = '<geom type="box" size="2 2 .001" pos="-2 0 2.5" group="1"/>'
    across = [patch(KEY, slab, (x, 0)).mean() for x in (-0.25, -0.1, 0, 0.1, 0.25)]
    assert across[0] == 0
    assert across[-1] == 1
    assert across[2] == pytest.approx(0.5, abs=0.1)
    assert across == sorted(across)
    assert 0.1 < across[1] < 0.4


def test_collision_shapes_cast_no_shadow() -> None:
    assert (patch(KEY, '<geom type="box" size="2 2 .1" pos="0 0 .5" group="3"/>', (0, 0)) == 1).all()


def test_pixels_on_other_surface_do_not_share_lamps() -> None:
    # left half of the pixels on a floor in the dark, right half on a table top in the light
    world = (
        '<geom name="table" type="box" size="1 2 .1" pos="1 0 .9" group="1"/>'
        '<geom type="box" size="1 2 .1" pos="-1 0 .5" group="1"/>'
    )
    caster = RayCaster(*scene(FLOOR + world))
    rows, columns = np.divmod(np.arange(SIDE * SIDE), SIDE)
    right = columns >= SIDE // 2
    points = np.column_stack([np.where(right, 0.5, -0.5), rows * 0.01, np.where(right, 1.0, 0.0)])
    up = np.tile((0.0, 0.0, 1.0), (SIDE * SIDE, 1))
    seen = openness(caster, KEY, Hits(right.astype(np.int32), np.ones(len(points)), up), points, range(SIDE), SIDE)
    assert (seen[right] == 1).all()
    assert (seen[~right] == 0).all()


def test_sides_of_one_body_do_not_share_lamps() -> None:
    # left half of the pixels on a wall's side that faces an awning close by, right half on its free top
    caster = RayCaster(
        *scene('<geom type="box" size="1 1 1" group="1"/><geom type="box" size=".5 1 .1" pos="1.6 0 1.2" group="1"/>')
    )
    columns = np.tile(np.arange(SIDE), SIDE)
    top = columns >= SIDE // 2
    points = np.where(top[:, None], (0.0, 0.0, 1.0), (1.0, 0.0, 0.5))
    normals = np.where(top[:, None], (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    hits = Hits(np.zeros(len(points), np.int32), np.ones(len(points)), normals)
    light = disc_lamp((2.2, 0, 5), (1, 0, 0), 0.2)
    seen = openness(caster, light, hits, points, range(SIDE), SIDE)
    assert (seen[top] == 1).all()
    assert (seen[~top] == 0).all()


def test_wall_before_half_of_lamps_is_open_to_the_rest() -> None:
    caster = RayCaster(*scene(FLOOR))
    along = np.tile((1.0, 0.0, 0.0), (SIDE * SIDE, 1))
    hits = Hits(np.zeros(SIDE * SIDE, np.int32), np.ones(SIDE * SIDE), along)
    points = np.tile((0.0, 0.0, 1.0), (SIDE * SIDE, 1))
    assert np.allclose(openness(caster, KEY, hits, points, range(SIDE), SIDE), 1)


def test_surfaces_facing_away_and_missing_hits_see_no_lamp() -> None:
    caster = RayCaster(*scene(FLOOR))
    points = np.zeros((4, 3))
    away = np.tile((0.0, 0.0, -1.0), (4, 1))
    assert (openness(caster, KEY, Hits(np.zeros(4, np.int32), np.ones(4), away), points, range(2), 2) == 0).all()
    missed = Hits(np.full(4, -1, np.int32), np.full(4, np.inf), np.zeros((4, 3)))
    assert (openness(caster, KEY, missed, points, range(2), 2) == 0).all()
