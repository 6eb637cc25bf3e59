import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.scene.scene import geom_colours, linear
from tests.rendering.scenes import scene

RED = '<material name="red" rgba="1 0 0 .5"/>'


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
    model, _ = scene(f'<geom type="sphere" size="1" {attributes}/>', RED)
    assert geom_colours(model)[0] == pytest.approx(colour)


@given(st.floats(0, 1), st.floats(0, 1))
def test_light_grows_with_the_screens_values(a: float, b: float) -> None:
    low, high = linear(np.array(sorted((a, b))))
    assert 0 <= low <= high <= 1.000001


def test_light_of_known_screen_values() -> None:
    # 0.5 is the usual example: a mid grey on the screen is about a fifth of the light
    assert linear(np.array([0, 0.04045, 0.5, 1])) == pytest.approx([0, 0.0031308, 0.21404, 1], abs=1e-5)
