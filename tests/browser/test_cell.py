"""A cell on the page: it looks as rays see it, its time obeys, several look on, and it comes back when it was gone.

The tests share a cell and a window, and so they follow each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.rendering.picture import render
from cellwright.rendering.views import view
from cellwright.viewer.web.start import WebPage
from tests.browser.conftest import Visit
from tests.browser.seen import Hues, Pixels, change, distance, middle, share
from tests.browser.serving import Viewed, viewed
from tests.browser.visitor import COARSE, HEIGHT, WIDTH, Visitor
from tests.ros1.ports import free_port

pytestmark = pytest.mark.browser

GREEN, ORANGE, BLUE = Hues(115.0, 25.0), Hues(22.0, 10.0, saturation=0.6), Hues(215.0, 14.0, saturation=0.6)
CLOCK = r"^(\d+\.\d\d)\s*s$"
PORT = free_port()


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewed]:
    """The lesson's cell in real time, for whoever wants to look."""
    folder = tmp_path_factory.mktemp("cell")
    with viewed(folder, "serve", "lesson", "--development-mode", "--port", str(PORT)) as process:
        yield process


@pytest.fixture(scope="module")
def onlooker(cell: Viewed, visit_all: Visit) -> Visitor:
    """Somebody who looks on at it."""
    return visit_all(cell.url)


@pytest.fixture(scope="module")
def cast() -> Pixels:
    """The same cell, drawn by casting rays."""
    simulation = Cell(load_trial([find_trial("lesson")]).trial).simulation
    simulation.refresh()
    size = round(WIDTH * COARSE), round(HEIGHT * COARSE)
    return render(simulation.model, simulation.data, view("overview"), *size)


def seconds(visitor: Visitor) -> float:
    """The time that the page tells [s]."""
    return float(visitor.read(CLOCK)[1])


def test_it_appears_as_rays_see_it(onlooker: Visitor, cast: Pixels) -> None:
    seen = onlooker.scene()
    for name, hues in {"belt": GREEN, "AGV 1": ORANGE, "AGV 2": BLUE}.items():
        assert middle(seen, hues) == pytest.approx(middle(cast, hues), abs=0.06), name
        assert share(seen, hues) == pytest.approx(share(cast, hues), rel=0.6), name
    assert distance(seen, cast) < 0.5


def test_time_passes_stands_and_passes_as_one_likes(onlooker: Visitor) -> None:
    begin = seconds(onlooker)
    onlooker.wait(lambda: seconds(onlooker) > begin, 60.0, lambda: "time that passes")
    onlooker.press("Pause")
    onlooker.read("^paused$")
    before = seconds(onlooker)
    onlooker.page.wait_for_timeout(1500)
    assert seconds(onlooker) == before
    onlooker.press("1 s")
    onlooker.wait(lambda: seconds(onlooker) == pytest.approx(before + 1.0, abs=0.011), 60.0, lambda: "a second more")
    onlooker.press("10")
    onlooker.read("asked 10 ×")


def test_another_who_comes_later_and_another_page_see_the_present(
    cell: Viewed, onlooker: Visitor, visit_all: Visit
) -> None:
    stands = seconds(onlooker)
    late = visit_all(cell.url)
    late.read("^paused$")
    assert seconds(late) == stands
    late.close()
    page = WebPage(("127.0.0.1", PORT), port=0)  # another process, which asks the same cell
    try:
        other = visit_all(page.url)
        other.read("^paused$")
        assert seconds(other) == stands
        other.press("Go on")
        onlooker.read("^running$")
        onlooker.wait(lambda: seconds(onlooker) > stands + 1.0, 60.0, lambda: "time that goes on")
        other.close()
    finally:
        page.close()


def test_one_that_was_gone_and_comes_back_is_another(cell: Viewed, tmp_path: Path, visit_all: Visit) -> None:
    page = WebPage(("127.0.0.1", PORT), port=0)  # it does not end with the cell
    try:
        faithful = visit_all(page.url)
        before = faithful.scene()
        cell.kill()
        faithful.read("Not connected:")
        with viewed(tmp_path, "serve", "sample", "--port", str(PORT)):
            faithful.wait(lambda: faithful.find("Not connected:") is None, 120.0, lambda: "cell that is back")
            faithful.read("^sample$")
            assert change(before, faithful.scene()) > 0.001  # other parts lie in other bins
    finally:
        page.close()
