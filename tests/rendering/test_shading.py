import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.rendering import shading
from cellwright.rendering.raycast import RayCaster
from cellwright.rendering.scene.scene import linear
from cellwright.rendering.shading import Shader, Surfaces, background, disc_lamp, sky, to_screen
from cellwright.util.pose import Vector3
from tests.rendering.scenes import scene

EYE = (0.0, -4.0, 2.0)
GREY = 'type="plane" size="60 60 1" rgba=".5 .5 .5 1" group="1"'


@pytest.fixture
def matte(monkeypatch: pytest.MonkeyPatch) -> None:
    """Surfaces without a highlight."""
    monkeypatch.setattr(shading, "HIGHLIGHT", 0.0)


def light_from(
    world: str, target: Vector3, *, key: float = 1.0, open_sky: float = 1.0, eye: Vector3 = EYE
) -> NDArray[np.float32]:
    """Light to the eye from its view of `target`."""
    model, data = scene(world)
    caster = RayCaster(model, data)
    lamps = disc_lamp((0, 0, 7), (0, 0, 0), 0.2), sky((0, 0, 0), 9)
    shader = Shader(caster, Surfaces(model, data), *lamps, np.array(eye), 1e-3)
    direction = np.subtract(target, eye)[None] / np.linalg.norm(np.subtract(target, eye))
    hits = caster.cast(shader.eye, direction)
    albedo = shader.albedo(hits, direction)
    received = shader.colour(hits, direction, albedo, np.full(1, key, np.float32), np.full(1, open_sky, np.float32))
    first: NDArray[np.float32] = received[0]
    return first


@pytest.mark.usefixtures("matte")
def test_light_of_lamp_and_sky_adds_up() -> None:
    floor = f"<geom {GREY}/>"
    dark, lamp, open_sky, both = (
        light_from(floor, (0.5, 0.5, 0), key=k, open_sky=s) for k, s in ((0, 0), (1, 0), (0, 1), (1, 1))
    )
    assert (dark > 0).all(), "the deepest corner is not black"
    assert lamp - dark == pytest.approx(both - open_sky, rel=1e-3)
    assert (lamp - dark > open_sky - dark).all(), "the lamp is the brighter light"


@pytest.mark.usefixtures("matte")
def test_light_falls_off_with_cosine() -> None:
    floor = f"<geom {GREY}/>"
    below, aside = (
        light_from(floor, p, open_sky=0) - light_from(floor, p, key=0, open_sky=0)
        for p in ((0.4, 0.4, 0), (4.4, 0.4, 0))
    )
    cosines = [7 / np.linalg.norm((x, 0.4, 7)) for x in (0.4, 4.4)]
    assert aside[1] / below[1] == pytest.approx(cosines[1] / cosines[0], rel=0.01)


@pytest.mark.usefixtures("matte")
def test_bright_colour_reflects_more_light() -> None:
    ball = '<geom type="sphere" size="1" rgba="{} {} .1 1" group="1"/>'
    light = light_from(ball.format(0.9, 0.3), (0, 0, 0.5))
    assert light[0] > light[1] > light[2]


def test_ball_has_highlight_where_it_mirrors_lamp(monkeypatch: pytest.MonkeyPatch) -> None:
    # the normal half way between lamp and eye; the centre lies on the origin, eye and lamp equally far
    ball = '<geom type="sphere" size="1" rgba=".2 .2 .2 1" group="1"/>'
    eye = (0.0, -7.0, 0.0)
    halfway = (0.0, -(0.5**0.5), 0.5**0.5)
    shiny, shaded = (light_from(ball, halfway, eye=eye, key=key) for key in (1, 0))
    monkeypatch.setattr(shading, "HIGHLIGHT", 0.0)
    assert (shiny > light_from(ball, halfway, eye=eye) + 0.05).all()
    assert shaded == pytest.approx(light_from(ball, halfway, eye=eye, key=0))


def test_surface_between_lamp_and_eye_has_finite_colour() -> None:
    plate = '<geom type="box" size="1 1 .01" rgba=".5 .5 .5 1" group="1"/>'
    shaded = light_from(plate, (0, 0, -0.01), eye=(0.0, 0.001, -7.0))
    model, data = scene(plate)
    caster = RayCaster(model, data)
    lamps = disc_lamp((0, 0, 7), (0, 0, 0), 1e-9), sky((0, 0, 0), 9)
    shader = Shader(caster, Surfaces(model, data), *lamps, np.array((0.0, 0.0, -7.0)), 1e-3)
    upwards = np.array([[0.0, 0.0, 1.0]])
    hits = caster.cast(shader.eye, upwards)
    one = np.ones(1, np.float32)
    assert shader.colour(hits, upwards, shader.albedo(hits, upwards), one, one)[0] == pytest.approx(shaded, abs=1e-4)


@pytest.mark.usefixtures("matte")
def test_distant_floor_fades_into_background() -> None:
    floor = f"<geom {GREY}/>"
    far = light_from(floor, (0, 40, 0))
    direction = np.subtract((0, 40, 0), EYE)[None] / np.linalg.norm(np.subtract((0, 40, 0), EYE))
    assert far == pytest.approx(background(direction)[0], abs=1e-6)
    assert light_from(floor, (0.5, 0.5, 0)) != pytest.approx(background(direction)[0], abs=0.05)


def test_sky_darkens_upwards_without_step() -> None:
    angles = np.linspace(-np.pi / 2, np.pi / 2, 200)
    light = background(np.column_stack([np.cos(angles), np.zeros(200), np.sin(angles)]))
    assert (np.diff(light, axis=0) <= 1e-6).all()
    assert np.abs(np.diff(light, axis=0)).max() < 0.02


@given(st.floats(0, 50), st.floats(0, 50))
def test_more_light_is_never_darker_on_screen(a: float, b: float) -> None:
    low, high = to_screen(np.array(sorted((a, b)), np.float32))
    assert low <= high


@given(st.integers(0, 200))
def test_screen_values_below_knee_are_kept(value: int) -> None:
    assert to_screen(linear(np.array([value / 255]))) == value


def test_brightest_light_is_still_valid_colour() -> None:
    assert to_screen(np.array([0.0, 1e9, np.float32(1e30)], np.float32)).tolist() == [0, 255, 255]
