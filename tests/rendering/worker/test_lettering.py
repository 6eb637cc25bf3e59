import numpy as np
import pytest

from cellwright.rendering.worker.lettering import write_line


def written(text: str, width: int = 640, height: int = 360) -> np.ndarray:
    picture = np.full((height, width, 3), 128, np.uint8)
    write_line(picture, text)
    return picture


def test_caption_is_in_lower_left_corner() -> None:
    rows, columns = np.nonzero((written("12.4 s   8 points") != 128).any(axis=2))
    assert rows.min() > 300
    assert columns.max() < 320
    assert (written("12.4 s") > 200).any()


def test_different_captions_look_different() -> None:
    assert not np.array_equal(written("12.4 s"), written("12.5 s"))
    assert np.array_equal(written("12.4 s"), written("12.4 s"))


def test_any_letters_are_on_one_line() -> None:
    boxes = [np.nonzero((written(text) != 128).any(axis=(1, 2)))[0] for text in ("aa", "gj|Å", "..", "")]
    assert len({(int(box.min()), int(box.max())) for box in boxes}) == 1


@pytest.mark.parametrize("text", ["", "x" * 500, "\u6f22\U0001f916\x00\n", "ä ö ü"])
@pytest.mark.parametrize("size", [(640, 360), (16, 16), (64, 1080)])
def test_any_caption_fits_any_picture(text: str, size: tuple[int, int]) -> None:
    assert written(text, *size).shape == (size[1], size[0], 3)
