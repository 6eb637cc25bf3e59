"""Times of pictures: all figures, from small pictures drawn by rays."""

import pytest

from benchmarks import pictures
from cellwright.rendering.backend import BACKEND, RAYS


@pytest.mark.slow
def test_pictures_benchmark_yields_figures_without_bounds_for_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, RAYS)
    monkeypatch.setattr(pictures, "_SIZES", ((4, 4, 1.0), (8, 6, 1.0)))
    monkeypatch.setattr(pictures, "_DEPTH_SIZE", (8, 6))
    progress: list[str] = []
    figures = {figure.label: figure for figure in pictures.measure(progress.append, quick=True)}
    assert list(figures) == [
        "a colour picture of 4 x 4",
        "a colour picture of 4 x 4, of 2 cells at once",
        "a colour picture of 8 x 6",
        "a colour picture of 8 x 6, of 2 cells at once",
        "a colour picture of 128 x 128, the whole cell",
        "colours and depths of 8 x 6",
        "a PointCloud2 of a picture of 8 x 6",
    ]
    assert all(figure.value > 0 and figure.unit == "ms" and figure.maximum is None for figure in figures.values())
    assert figures["a colour picture of 4 x 4"].note == RAYS
    assert progress[0] == "2 cells"


def test_pictures_of_opengl_have_bounds() -> None:
    assert pictures._bound("llvmpipe, OpenGL 4.5", 4.0) == 4.0
    assert pictures._bound(RAYS, 4.0) is None
