"""Picture checks of the browser tests, on pictures with known content."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.browser.seen import Hues, Pixels, change, distance, middle, pixels, share, variety

GREEN, ORANGE = Hues(120.0), Hues(30.0)


def canvas(colour: tuple[int, int, int] = (230, 230, 230)) -> Pixels:
    return np.full((100, 200, 3), colour, np.uint8)


def with_box(colour: tuple[int, int, int]) -> Pixels:
    """Box on the right, above the middle: a tenth of the picture."""
    picture = canvas()
    picture[10:50, 140:190] = colour
    return picture


def test_pixels_of_png_match_picture() -> None:
    kept = io.BytesIO()
    Image.fromarray(with_box((10, 200, 30))).save(kept, "png")
    assert np.array_equal(pixels(kept.getvalue()), with_box((10, 200, 30)))


def test_variety_of_empty_page_is_one() -> None:
    assert variety(canvas()) == 1
    assert variety(with_box((10, 200, 30))) == 2


def test_share_and_middle_find_box_by_colour() -> None:
    picture = with_box((10, 200, 30))
    assert share(picture, GREEN) == pytest.approx(0.1)
    assert share(picture, ORANGE) == 0.0
    assert middle(picture, GREEN) == pytest.approx((0.82, 0.3), abs=0.01)
    assert np.isnan(middle(picture, ORANGE)[0])


@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_share_of_hue_matches_colorsys(colour: tuple[int, int, int]) -> None:
    import colorsys

    hue, saturation, value = colorsys.rgb_to_hsv(*(part / 255 for part in colour))
    far = abs((hue * 360 - 120 + 180) % 360 - 180)
    if all(abs(x) > 1e-3 for x in (far - 25, saturation - 0.3, value - 0.15)):
        assert share(canvas(colour), GREEN) == (far < 25 and saturation > 0.3 and value > 0.15)


def test_change_is_share_of_changed_pixels() -> None:
    assert change(canvas(), canvas()) == 0.0
    assert change(canvas(), with_box((10, 200, 30))) == pytest.approx(0.1)
    assert change(canvas(), canvas((225, 230, 235))) == 0.0


def test_distance_measures_difference_of_colours() -> None:
    assert distance(with_box((10, 200, 30)), with_box((10, 200, 30))) == 0.0
    assert distance(canvas(), with_box((10, 200, 30))) == pytest.approx(0.1)
    assert distance(canvas(), canvas((0, 0, 0))) == 1.0
