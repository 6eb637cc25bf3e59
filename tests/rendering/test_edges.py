import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.picture import SurfaceLayer, edge_pixels, pixel_points
from cellwright.rendering.raycast import Hits

WIDTH, HEIGHT = 6, 4
COUNT = WIDTH * HEIGHT


def flat_layer() -> SurfaceLayer:
    """Layer of one level grey surface."""
    up = np.tile((0.0, 0.0, 1.0), (COUNT, 1))
    zeros = np.zeros(COUNT, np.float32)
    albedo = np.full((COUNT, 3), 0.5, np.float32)
    return SurfaceLayer(Hits(np.zeros(COUNT, np.int32), np.ones(COUNT), up), albedo, zeros, zeros, WIDTH)


def around(row: int, column: int) -> set[int]:
    """Pixel and its neighbours in the same row and column."""
    places = {(row, column), (row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)}
    return {r * WIDTH + c for r, c in places if 0 <= r < HEIGHT and 0 <= c < WIDTH}


def test_single_surface_has_no_edges() -> None:
    assert len(edge_pixels(flat_layer())) == 0


def test_empty_space_has_no_edges() -> None:
    layer = flat_layer()
    layer.hits.geom[:] = -1
    layer.hits.normal[:] = 0
    assert len(edge_pixels(layer)) == 0


@given(st.integers(0, HEIGHT - 1), st.integers(0, WIDTH - 1), st.sampled_from(["geom", "normal", "albedo"]))
def test_differing_pixel_makes_edge_with_neighbours(row: int, column: int, difference: str) -> None:
    layer = flat_layer()
    at = row * WIDTH + column
    if difference == "geom":
        layer.hits.geom[at] = 1
    elif difference == "normal":
        layer.hits.normal[at] = (0.0, 1.0, 0.0)
    else:
        layer.albedo[at, 1] = 0.6
    assert set(edge_pixels(layer).tolist()) == around(row, column)


@given(st.integers(1, 8), st.lists(st.integers(0, 999), min_size=1, max_size=5))
def test_sample_points_lie_within_pixel_around_middle(samples: int, numbers: list[int]) -> None:
    pixels = np.array(numbers)
    points = pixel_points(pixels, 40, samples=samples).reshape(len(pixels), -1, 2)
    inside = points - np.column_stack([pixels % 40, pixels // 40])[:, None, :]
    assert ((inside > 0) & (inside < 1)).all()
    assert np.allclose(inside.mean(axis=1), 0.5)
    for axis in (0, 1):
        assert len(np.unique(inside[0, :, axis].round(9))) == samples**2, "no two in one row or column"
