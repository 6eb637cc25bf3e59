"""Cell page: it looks like the ray-cast picture, controls time, serves several viewers, and survives a restart.

The tests share a cell and a window, so their order matters.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.rendering.picture import CastRenderer, PictureRequest
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.views import gear2017_views
from cellwright.viewer.web.start import WebPage, page_source
from tests.browser.conftest import Visit
from tests.browser.seen import Hues, Pixels, distance, middle, share
from tests.browser.visitor import COARSE, HEIGHT, WIDTH, Visitor
from tests.support.ports import free_port
from tests.support.processes import Process
from tests.support.warm import warm_start

pytestmark = pytest.mark.browser

GREEN, ORANGE, BLUE = Hues(115.0, 25.0), Hues(22.0, 10.0, saturation=0.6), Hues(215.0, 14.0, saturation=0.6)
CLOCK = r"^(\d+\.\d\d)\s*s$"
ADDRESS = ("127.0.0.1", free_port())


@contextmanager
def served(folder: Path, trial: str) -> Iterator[Process]:
    """Serve a cell at the address until the end."""
    command = [sys.executable, "-m", "cellwright", "serve", trial, "--development-mode", "--port", str(ADDRESS[1])]
    process = Process(command, os.environ, folder, warm=warm_start())
    try:
        process.wait_for(r"^ready: ")
        yield process
    finally:
        process.kill()


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    """Cell of the lesson in real time, for any client."""
    with served(tmp_path_factory.mktemp("cell"), "lesson") as process:
        yield process


@pytest.fixture(scope="module")
def page(cell: Process) -> Iterator[WebPage]:
    """Page of the cell, which outlives it."""
    assert cell.running
    page = WebPage(page_source(ADDRESS), port=0)
    yield page
    page.close()


@pytest.fixture(scope="module")
def visitor(page: WebPage, visit_all: Visit) -> Visitor:
    """Browser on the page."""
    return visit_all(page.url)


@pytest.fixture(scope="module")
def cast() -> Pixels:
    """Ray-cast picture of the same cell."""
    cell = Cell(load_trial([find_trial("lesson")]).trial)
    cell.simulation.refresh()
    capture = SceneCapture.of(cell)
    frame = capture.frame(cell.simulation.data, 0)
    request = PictureRequest(gear2017_views()["overview"], round(WIDTH * COARSE), round(HEIGHT * COARSE))
    return CastRenderer(capture.scene).colour(frame, request)


def seconds(visitor: Visitor) -> float:
    """Time on the page [s]."""
    return float(visitor.read(CLOCK)[1])


def test_page_shows_cell_as_ray_renderer_does(visitor: Visitor, cast: Pixels) -> None:
    seen = visitor.scene()
    for name, hues in {"belt": GREEN, "AGV 1": ORANGE, "AGV 2": BLUE}.items():
        assert middle(seen, hues) == pytest.approx(middle(cast, hues), abs=0.06), name
        assert share(seen, hues) == pytest.approx(share(cast, hues), rel=0.6), name
    assert distance(seen, cast) < 0.5


def test_pause_and_step_buttons_control_time(visitor: Visitor) -> None:
    begin = seconds(visitor)
    visitor.wait(lambda: seconds(visitor) > begin, "time that passes")
    visitor.press("Pause")
    visitor.read("^paused$")
    before = seconds(visitor)
    visitor.press("10")
    visitor.read("target 10 ×")  # a round trip, in which no time passes
    assert seconds(visitor) == before
    visitor.press("1 s")
    visitor.wait(lambda: seconds(visitor) == pytest.approx(before + 1.0, abs=0.011), "second more")


def test_second_browser_sees_present_state_and_may_control(page: WebPage, visitor: Visitor, visit_all: Visit) -> None:
    stands = seconds(visitor)
    late = visit_all(page.url)
    late.read("^paused$")
    assert seconds(late) == stands
    late.press("Resume")
    visitor.read("^running$")
    visitor.wait(lambda: seconds(visitor) > stands + 1.0, "time that goes on")
    visitor.press("Pause")
    late.read("^paused$")
    late.close()


def test_hidden_tab_stands_and_shows_present_state_once_it_is_shown(
    page: WebPage, visitor: Visitor, visit_all: Visit
) -> None:
    other = visit_all(page.url)
    other.read("^paused$")
    visitor.press("Resume")
    other.read("^running$")
    other.hide(is_hidden=True)

    def stands() -> bool:
        before, begin = seconds(other), seconds(visitor)
        visitor.wait(lambda: seconds(visitor) > begin + 1.0, "time that goes on")
        return seconds(other) == before

    visitor.wait(stands, "tab that stands")
    other.hide(is_hidden=False)
    now = seconds(visitor)
    other.wait(lambda: seconds(other) >= now, "present time")
    visitor.press("Pause")
    other.read("^paused$")
    other.close()


def test_page_shows_new_cell_after_reconnect(cell: Process, visitor: Visitor, tmp_path: Path) -> None:
    before = visitor.scene()
    cell.kill()
    visitor.read("Not connected:")
    with served(tmp_path, "sample"):
        visitor.wait(lambda: visitor.find("Not connected:") is None, "cell that is back")
        visitor.read("^sample$")
        visitor.change(before, 3e-4)  # other parts are in other bins
        belt = pytest.approx(middle(before, GREEN), abs=0.06)
        visitor.wait(lambda: middle(visitor.canvas(), GREEN) == belt, "the same belt, once all of it is drawn")
