"""The scene on the page: a cell as it is drawn by casting rays, a robot, and what others are not shown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Error

from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.rendering.picture import render
from cellwright.rendering.views import view
from tests.browser.conftest import Visit
from tests.browser.seen import Hues, Pixels, distance, middle, share
from tests.browser.serving import Viewed, viewed
from tests.browser.visitor import COARSE, HEIGHT, LIMIT, WIDTH

pytestmark = pytest.mark.browser

GREEN, ORANGE, BLUE = Hues(115.0, 25.0), Hues(22.0, 10.0, saturation=0.6), Hues(215.0, 14.0, saturation=0.6)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewed]:
    """The lesson's cell in real time, for whoever wants to look."""
    with viewed(tmp_path_factory.mktemp("cell"), "serve", "lesson", "--development", "--port", "0") as process:
        yield process


@pytest.fixture(scope="module")
def cast() -> Pixels:
    """The same cell, drawn by casting rays."""
    trial = load_trial([find_trial("lesson")]).trial
    simulation = Cell(trial).simulation
    simulation.refresh()
    size = round(WIDTH * COARSE), round(HEIGHT * COARSE)
    return render(simulation.model, simulation.data, view("overview"), *size)


def test_the_cell_appears_as_rays_see_it(cell: Viewed, cast: Pixels, visit: Visit) -> None:
    seen = visit(cell.url).scene()
    for name, hues in {"belt": GREEN, "AGV 1": ORANGE, "AGV 2": BLUE}.items():
        there = middle(cast, hues)
        assert middle(seen, hues) == pytest.approx(there, abs=0.06), name
        assert share(seen, hues) == pytest.approx(share(cast, hues), rel=0.6), name
    assert distance(seen, cast) < 0.5


def test_a_robot_appears(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "teleop", "qinglong", "--port", "0") as robot:
        seen = visit(robot.url).scene()
        assert 0.02 < (seen.min(axis=-1) < 150).mean() < 0.6  # something dark stands before a light background


def test_without_the_token_there_is_nothing_to_see(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "serve", "lesson", "--port", "0", "--view-host", "0.0.0.0") as cell:
        address, _, token = cell.url.partition("/?token=")
        assert len(token) > 20
        address = f"http://127.0.0.1:{address.rpartition(':')[2]}/"
        for wrong in (address, f"{address}?token={token[:-1]}x"):
            stranger = visit(wrong)
            assert "token" in stranger.read("token")[0]
            assert stranger.page.locator("canvas").count() == 0
            with pytest.raises(Error):
                stranger.page.evaluate(
                    "address => new Promise((good, bad) => { const s = new WebSocket(address);"
                    " s.onopen = good; s.onerror = () => bad('refused') })",
                    wrong.replace("http", "ws"),
                )
        friend = visit(f"{address}?token={token}")
        friend.page.locator("canvas").first.wait_for(timeout=LIMIT * 1e3)
        assert friend.find("needs the token") is None
