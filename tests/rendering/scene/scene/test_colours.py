import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.scene.scene import linear


@given(st.floats(0, 1), st.floats(0, 1))
def test_linear_grows_with_srgb_value(a: float, b: float) -> None:
    low, high = linear(np.array(sorted((a, b))))
    assert 0 <= low <= high <= 1.000001


def test_linear_of_known_srgb_values() -> None:
    # 0.5 is the usual example: a mid grey on the screen is about a fifth of the light
    assert linear(np.array([0, 0.04045, 0.5, 1])) == pytest.approx([0, 0.0031308, 0.21404, 1], abs=1e-5)
