import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.rendering.scene.scene import linear
from cellwright.rendering.shading import Surfaces
from tests.rendering.scenes import scene


def surfaces_of(world: str) -> Surfaces:
    return Surfaces(*scene(world))


def grey_at(
    surfaces: Surfaces, points: list[tuple[float, float, float]], footprint: float = 0.0
) -> NDArray[np.float32]:
    count = len(points)
    colours = surfaces.albedo(np.zeros(count, np.int32), np.array(points), np.full(count, footprint))
    assert np.allclose(colours, colours[:, :1], atol=1e-6)
    return colours[:, 0]


def test_floor_has_line_each_metre() -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    tile, line, crossing = grey_at(surfaces, [(0.5, 0.5, 0), (2.0, 0.5, 0), (-3.0, 1.0, 0)])
    assert tile == pytest.approx(linear(np.array([0.5]))[0])
    assert line == pytest.approx(0.8 * tile)
    assert crossing == pytest.approx(line)


def test_floor_lines_blur_in_large_pixels() -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    sharp, soft, gone = (grey_at(surfaces, [(0.0, 0.5, 0)], size)[0] for size in (0.001, 0.05, 10))
    tile = grey_at(surfaces, [(0.5, 0.5, 0)])[0]
    assert sharp < soft < gone <= tile
    assert gone == pytest.approx(tile, rel=1e-2)


@pytest.mark.slow
@given(st.floats(0.001, 0.4))
def test_blurred_line_keeps_its_ink(footprint: float) -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    across = np.linspace(-0.5, 0.5, 4001)
    shades = grey_at(surfaces, [(x, 0.5, 0.0) for x in across], footprint)
    ink = (1 - shades / shades.max()).mean()
    assert ink == pytest.approx(0.2 * 0.012, rel=0.05)
