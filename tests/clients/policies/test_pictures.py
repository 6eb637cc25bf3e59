"""Pictures fitted as OpenPI's client fits them: sizes, borders, and the greys of Pillow's bilinear filter."""

import hashlib
from typing import Any

import numpy as np
import pytest

from cellwright.clients.policies.pictures import fitted
from tests.conftest import load_cases


@pytest.mark.parametrize("case", load_cases("resized_pictures_cases.json"), ids=lambda case: case["name"])
def test_picture_is_that_of_the_reference(case: dict[str, Any]) -> None:
    (width, height), (wanted_width, wanted_height) = case["size"], case["wanted"]
    row, column, channel = np.mgrid[0:height, 0:width, 0:3]
    source = ((column * column // 7 + 13 * row + column * row // 5 + 50 * channel) % 256).astype(np.uint8)
    found = fitted(source, (wanted_width, wanted_height))
    if "pixels" in case:
        assert found.tolist() == case["pixels"]
    assert hashlib.sha256(found.tobytes()).hexdigest() == case["sha256"]


def test_picture_of_the_size_stays_as_it_is() -> None:
    picture = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    assert fitted(picture, (4, 4)) is picture


@pytest.mark.parametrize(
    ("shape", "size", "rows", "columns"),
    [
        ((480, 640), (224, 224), slice(28, 196), slice(0, 224)),
        ((640, 480), (224, 224), slice(0, 224), slice(28, 196)),
        ((480, 640), (224, 112), slice(0, 112), slice(37, 186)),  # 149 columns: rounded down, as (224 - 149) / 2 is
        ((1, 1000), (224, 224), slice(111, 112), slice(0, 224)),
    ],
)
def test_picture_lies_in_the_middle_of_black_borders(
    shape: tuple[int, int], size: tuple[int, int], rows: slice, columns: slice
) -> None:
    found = fitted(np.full((*shape, 3), 200, np.uint8), size)
    assert found.shape == (size[1], size[0], 3)
    inside = np.zeros(found.shape[:2], bool)
    inside[rows, columns] = True
    assert (found[inside] == 200).all()
    assert (found[~inside] == 0).all()


def test_greys_are_those_of_a_triangle_filter_over_the_larger_pixel() -> None:
    # four columns to two: each new pixel covers two, with weights 1, 3, 3, 1 of 8 over four; the ends have three
    picture = np.zeros((2, 4, 3), np.uint8)
    picture[:, :, 0] = [0, 80, 160, 240]
    assert fitted(picture, (2, 1))[0, :, 0].tolist() == [
        round((3 * 0 + 3 * 80 + 160) / 7),
        round((80 + 3 * 160 + 3 * 240) / 7),
    ]
