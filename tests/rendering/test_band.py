import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering import picture
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import render
from tests.rendering.scenes import clutter


@given(st.integers(1, 5000))
def test_bands_have_each_row_once(height: int) -> None:
    rows = [row for rows in picture.bands(height) for row in rows]
    assert rows == list(range(height))
    assert all(picture.bands(height))


@pytest.mark.slow
def test_banded_picture_equals_whole_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    model, data = clutter(5)
    model.geom_rgba[::3, 3] = 0.5
    camera = Camera((4, -5, 2), (0, 0, 0))
    whole = render(model, data, camera, (90, 60))
    for height in (1, 7, 25):
        monkeypatch.setattr(picture, "BAND_HEIGHT", height)
        assert np.array_equal(render(model, data, camera, (90, 60)), whole)
