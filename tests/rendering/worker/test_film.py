from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from cellwright.rendering.worker.film import Film, FilmError

WIDTH, HEIGHT = 64, 48


def grey(level: int) -> np.ndarray:
    return np.full((HEIGHT, WIDTH, 3), level, np.uint8)


def read(file: Path) -> list[np.ndarray]:
    with av.open(str(file)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_film_plays_added_pictures(tmp_path: Path) -> None:
    file = tmp_path / "a.mp4"
    film = Film(file, WIDTH, HEIGHT, Fraction(25))
    for level in range(40):
        film.add(grey(5 * level))
    assert film.finish() == 40
    assert [round(float(picture.mean())) for picture in read(file)] == pytest.approx([5 * n for n in range(40)], abs=4)
    with av.open(str(file)) as container:
        stream = container.streams.video[0]
        assert (float(stream.average_rate or 0), stream.width, stream.height) == (25, WIDTH, HEIGHT)
        assert (stream.codec_context.pix_fmt, stream.duration) == (
            "yuv420p",
            stream.time_base and 1.6 / stream.time_base,
        )
    assert [each.name for each in tmp_path.iterdir()] == ["a.mp4"]
    assert file.read_bytes().index(b"moov") < file.read_bytes().index(b"mdat")  # players need not read it all


def test_film_keeps_colours_of_pictures(tmp_path: Path) -> None:
    file, given = tmp_path / "a.mp4", np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    for number, colour in enumerate(((230, 40, 30), (30, 200, 60), (40, 60, 220), (200, 190, 40))):
        given[:, 16 * number : 16 * (number + 1)] = colour
    film = Film(file, WIDTH, HEIGHT, Fraction(10))
    for _ in range(3):
        film.add(given)
    film.finish()
    with av.open(str(file)) as container:
        frame = next(container.decode(video=0))
        assert frame.colorspace == 1  # BT.709
        shown = frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray()
    middles = np.s_[HEIGHT // 2, 8::16]
    assert shown[middles].astype(int) == pytest.approx(given[middles].astype(int), abs=12)


def test_unfinished_film_is_playable(tmp_path: Path) -> None:
    file = tmp_path / "a.mp4"
    film = Film(file, WIDTH, HEIGHT, Fraction(25))
    for level in range(100):
        film.add(grey(2 * level))
    pictures = read(file)  # while it is still open
    assert len(pictures) >= 50
    assert float(pictures[40].mean()) == pytest.approx(80, abs=4)
    film.finish()


def test_film_without_pictures_has_no_frames(tmp_path: Path) -> None:
    assert Film(tmp_path / "a.mp4", WIDTH, HEIGHT, Fraction(25)).finish() == 0


def test_unwritable_film_is_reported_with_reason(tmp_path: Path) -> None:
    with pytest.raises(FilmError, match=r"no/a\.mp4: No such file or directory"):
        Film(tmp_path / "no" / "a.mp4", WIDTH, HEIGHT, Fraction(25))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a disk that is always full")
def test_full_disk_is_reported() -> None:
    film = Film(Path("/dev/full"), WIDTH, HEIGHT, Fraction(25))
    with pytest.raises(FilmError, match="No space left on device"):
        _fill(film)


def _fill(film: Film) -> None:
    for level in range(200):
        film.add(grey(level))
    film.finish()
