import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.rendering.scene.scene import geom_colours, linear
from cellwright.rendering.shading import Surfaces
from tests.rendering.scenes import scene

MATERIALS = """
<material name="red" rgba="1 0 0 .5" specular=".9" shininess=".8"/>
<texture name="halves" type="2d" builtin="checker" width="64" height="64" rgb1="1 1 1" rgb2="0 0 0"/>
<material name="once" texture="halves" texrepeat="1 1"/>
<material name="stretched" texture="halves" texrepeat="2 2"/>
<material name="by_length" texture="halves" texrepeat="2 2" texuniform="true"/>
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


def test_gloss_comes_from_the_material() -> None:
    surfaces = surfaces_of(
        '<geom type="plane" size="1 1 1" material="red"/><geom type="box" size="1 1 1" material="red"/>'
        '<geom type="plane" size="1 1 1"/>'
    )
    assert surfaces.specular[:2] == pytest.approx((0.9, 0.9))
    assert surfaces.shininess[:2] == pytest.approx((0.8, 0.8))
    assert 0 < surfaces.specular[2] < 0.9
    assert 0 < surfaces.shininess[2] < 0.8
    assert surfaces.opacity == pytest.approx((0.5, 0.5, 1))


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


@pytest.mark.slow
@given(st.floats(0.001, 0.4))
def test_blurring_a_line_keeps_its_amount_of_ink(footprint: float) -> None:
    surfaces = surfaces_of('<geom type="plane" size="9 9 1" rgba=".5 .5 .5 1"/>')
    across = np.linspace(-0.5, 0.5, 4001)
    shades = grey_at(surfaces, [(x, 0.5, 0.0) for x in across], footprint)
    ink = (1 - shades / shades.max()).mean()
    assert ink == pytest.approx(0.2 * 0.012, rel=0.05)


def corner_colours(plane: str) -> Surfaces:
    """A plane whose texture is red and green in its upper corners, blue and white in its lower ones."""
    model, data = scene(f'<geom type="plane" {plane}/>', MATERIALS)
    texels = np.zeros((64, 64, 3), np.uint8)
    texels[:32, :32], texels[:32, 32:], texels[32:, :32], texels[32:, 32:] = (
        (255, 0, 0),
        (0, 255, 0),
        (0, 0, 255),
        (255, 255, 255),
    )
    model.tex_data[:] = texels.reshape(-1)
    return Surfaces(model, data, geom_colours(model))


def colour_name(surfaces: Surfaces, x: float, y: float) -> str:
    colour = surfaces.albedo(np.zeros(1, np.int32), np.array([[x, y, 0]]), np.zeros(1))[0]
    return {(1, 0, 0): "red", (0, 1, 0): "green", (0, 0, 1): "blue", (1, 1, 1): "white"}[
        tuple(colour.round(3).tolist())
    ]


@pytest.mark.parametrize(
    ("plane", "tile"),
    [
        ('size="2 1 1" material="once"', (4, 2)),
        ('size="2 1 1" material="stretched"', (2, 1)),
        ('size="2 1 1" material="by_length"', (1, 1)),
        ('size="0 0 1" material="once"', (2, 2)),
        ('size="0 0 1" material="by_length"', (1, 1)),
    ],
)
def test_a_texture_lies_as_the_engine_lays_it(plane: str, tile: tuple[float, float]) -> None:
    # the size of a tile in metres was read off pictures of the engine's own renderer
    surfaces = corner_colours(plane)
    half = np.array([2, 1]) if 'size="2' in plane else np.array([1, 1])
    for down, right, name in ((0, 0, "red"), (0, 1, "green"), (1, 0, "blue"), (1, 1, "white")):
        x = -half[0] + tile[0] * (0.25 + 0.5 * right)
        y = half[1] - tile[1] * (0.25 + 0.5 * down)
        assert colour_name(surfaces, x, y) == name
        if tile[0] < 2 * half[0] or 'size="0' in plane:
            assert colour_name(surfaces, x + tile[0], y - tile[1] * (tile[1] < 2)) == name


def test_a_texture_goes_with_its_plane() -> None:
    surfaces = corner_colours('size="1 1 1" pos="5 3 0" euler="0 0 1.5707963" material="once"')
    assert [colour_name(surfaces, 5 + x, 3 + y) for x, y in ((-0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (0.5, -0.5))] == [
        "red",
        "white",
        "green",
        "blue",
    ]


@pytest.mark.parametrize("channels", [1, 2, 4])
def test_a_texture_may_be_grey_or_have_more_channels(channels: int) -> None:
    spec = mujoco.MjSpec()
    texels = np.zeros((4, 4, channels), np.uint8)
    texels[:, :, : min(channels, 3)] = 51
    texture = spec.add_texture(name="even", type=mujoco.mjtTexture.mjTEXTURE_2D, width=4, height=4, nchannel=channels)
    texture.data = texels.tobytes()
    material = spec.add_material(name="plain")
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "even"
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], material="plain")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    surfaces = Surfaces(model, data, geom_colours(model))
    assert grey_at(surfaces, [(0.1, 0.2, 0)]) == pytest.approx(linear(np.array([0.2])))
