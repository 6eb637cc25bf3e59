import numpy as np
import pytest

from cellwright.rendering.picture import SurfaceLayer, spread
from cellwright.rendering.raycast import Hits

WIDTH, HEIGHT = 4, 3
COUNT = WIDTH * HEIGHT


def numbered_layer() -> SurfaceLayer:
    """Layer with another geom in every pixel: pixel n sees n / 100 of the lamp and n / 50 of the sky."""
    number = np.arange(COUNT)
    up = np.tile((0.0, 0.0, 1.0), (COUNT, 1))
    hits = Hits(number.astype(np.int32), np.ones(COUNT), up)
    key, sky = (number / 100).astype(np.float32), (number / 50).astype(np.float32)
    return SurfaceLayer(hits, np.zeros((COUNT, 3), np.float32), key, sky, WIDTH)


def one_hit(geom: int, normal: tuple[float, float, float] = (0, 0, 1)) -> Hits:
    return Hits(np.array([geom], np.int32), np.ones(1), np.array([normal], np.float64))


@pytest.mark.parametrize("geom", [0, 1, 2, 4, 5, 6, 8, 9, 10])
def test_light_is_borrowed_from_neighbour_on_same_geom(geom: int) -> None:
    key, sky = numbered_layer().borrow(np.array([5]), one_hit(geom))
    assert key[0] == pytest.approx(geom / 100)
    assert sky[0] == pytest.approx(geom / 50)


@pytest.mark.parametrize("hit", [one_hit(3), one_hit(7), one_hit(99), one_hit(6, (0, 1, 0))])
def test_pixel_without_such_neighbour_keeps_own_light(hit: Hits) -> None:
    key, sky = numbered_layer().borrow(np.array([5]), hit)
    assert key[0] == pytest.approx(0.05)
    assert sky[0] == pytest.approx(0.10)


@pytest.mark.parametrize(("corner", "opposite"), [(0, 11), (3, 8), (8, 3), (11, 0)])
def test_border_pixel_borrows_nothing_from_opposite_side(corner: int, opposite: int) -> None:
    key, _ = numbered_layer().borrow(np.array([corner]), one_hit(opposite))
    assert key[0] == pytest.approx(corner / 100)


def test_hits_are_spread_among_rays() -> None:
    hits = spread(one_hit(7), np.array([2]), 4)
    assert hits.geom.tolist() == [-1, -1, 7, -1]
    assert hits.distance.tolist() == [np.inf, np.inf, 1, np.inf]
    assert hits.normal[:, 2].tolist() == [0, 0, 1, 0]
