import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.viewer.surfaces import Surfaces, geom_colours, linear
from tests.viewer.scenes import scene

MATERIALS = """
<material name="red" rgba="1 0 0 .5" specular=".9" shininess=".8" reflectance=".7"/>
<texture name="halves" type="2d" builtin="checker" width="64" height="64" rgb1="1 1 1" rgb2="0 0 0"/>
<material name="checked" texture="halves" texrepeat="1 1" texuniform="true"/>
<material name="stretched" texture="halves" texrepeat="2 2" texuniform="false"/>
"""


def surfaces_of(world: str) -> Surfaces:
    model, data = scene(world, MATERIALS)
    return Surfaces(model, data, geom_colours(model))


def grey_at(
    surfaces: Surfaces, points: list[tuple[float, float, float]], footprint: float = 0.0
) -> NDArray[np.float32]:
    count = len(points)
    colours = surfaces.albedo(np.zeros(count, np.int32), np.array(points), np.full(count, footprint))
    assert np.allclose(colours, colours[:, :1], atol=1e-6)
    return colours[:, 0]


@pytest.mark.parametrize(
    ("attributes", "colour"),
    [
        ('rgba=".1 .2 .3 .4"', (0.1, 0.2, 0.3, 0.4)),
        ('material="red"', (1, 0, 0, 0.5)),
        ('material="red" rgba=".1 .2 .3 1"', (0.1, 0.2, 0.3, 1)),
        ("", (0.5, 0.5, 0.5, 1)),
    ],
)
def test_a_geom_shows_its_own_colour_or_else_its_materials(attributes: str, colour: tuple[float, ...]) -> None:
    model, _ = scene(f'<geom type="sphere" size="1" {attributes}/>', MATERIALS)
    assert geom_colours(model)[0] == pytest.approx(colour)


def test_gloss_comes_from_the_material_and_only_planes_are_mirrors() -> None:
    surfaces = surfaces_of(
        '<geom type="plane" size="1 1 1" material="red"/><geom type="box" size="1 1 1" material="red"/>'
        '<geom type="plane" size="1 1 1"/>'
    )
    assert surfaces.specular[:2] == pytest.approx((0.9, 0.9))
    assert surfaces.shininess[:2] == pytest.approx((0.8, 0.8))
    assert surfaces.reflectance[:2] == pytest.approx((0.7, 0))
    assert 0 < surfaces.reflectance[2] < 0.7
    assert surfaces.opacity == pytest.approx((0.5, 0.5, 1))


@given(st.floats(0, 1), st.floats(0, 1))
def test_light_grows_with_the_screens_values(a: float, b: float) -> None:
    low, high = linear(np.array(sorted((a, b))))
    assert 0 <= low <= high <= 1.000001


def test_light_of_known_screen_values() -> None:
    # 0.5 is the usual example: a mid grey on the screen is about a fifth of the light
    assert linear(np.array([0, 0.04045, 0.5, 1])) == pytest.approx([0, 0.0031308, 0.21404, 1], abs=1e-5)


def test_a_floor_without_texture_has_a_line_each_metre() -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    tile, line, crossing = grey_at(surfaces, [(0.5, 0.5, 0), (2.0, 0.5, 0), (-3.0, 1.0, 0)])
    assert tile == pytest.approx(linear(np.array([0.5]))[0])
    assert line == pytest.approx(0.8 * tile)
    assert crossing == pytest.approx(line)


def test_lines_blur_when_a_pixel_covers_more_than_they_do() -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    sharp, soft, gone = (grey_at(surfaces, [(0.0, 0.5, 0)], size)[0] for size in (0.001, 0.05, 10))
    tile = grey_at(surfaces, [(0.5, 0.5, 0)])[0]
    assert sharp < soft < gone <= tile
    assert gone == pytest.approx(tile, rel=1e-2)


@given(st.floats(0.001, 0.4))
def test_blurring_a_line_keeps_its_amount_of_ink(footprint: float) -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    across = np.linspace(-0.5, 0.5, 4001)
    shades = grey_at(surfaces, [(x, 0.5, 0.0) for x in across], footprint)
    ink = (1 - shades / shades.max()).mean()
    assert ink == pytest.approx(0.2 * 0.012, rel=0.05)


def test_a_texture_is_laid_over_a_plane_by_the_metre() -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" pos="5 0 2" material="checked"/>')
    inside = [(5 + x, y, 2.0) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    a, b, c, d = grey_at(surfaces, inside)
    assert {a, b} == {0, 1}
    assert (c, d) == (b, a)
    assert np.array_equal(grey_at(surfaces, [(x + 3, y - 4, z) for x, y, z in inside]), [a, b, c, d])


def test_a_texture_is_stretched_over_a_plane() -> None:
    surfaces = surfaces_of('<geom type="plane" size="2 2 1" material="stretched"/>')
    a, b, far_a = grey_at(surfaces, [(0.5, 0.5, 0), (0.5, 1.5, 0), (0.5 - 2, 0.5, 0)])
    assert {a, b} == {0, 1}
    assert far_a == a
