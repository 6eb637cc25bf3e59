"""Other pages: of a robot, and one that is open to the network."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Error

from tests.browser.conftest import Visit
from tests.browser.serving import viewed

pytestmark = pytest.mark.browser


def test_page_shows_robot_with_controls(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "teleop", "qinglong", "--port", "0") as robot:
        visitor = visit(robot.url)
        visitor.read("(?i)stop")
        seen = visitor.scene(min_colours=4)
        assert 0.002 < (seen.max(axis=-1) < 110).mean() < 0.5  # something dark before a light background


def test_page_without_token_is_refused(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "serve", "lesson", "--port", "0", "--view-host", "0.0.0.0") as cell:
        address, _, token = cell.url.partition("/?token=")
        assert len(token) > 20
        address = f"http://127.0.0.1:{address.rpartition(':')[2]}/"
        stranger = visit(address)
        assert "wrong token" in stranger.text()
        for wrong in (address, f"{address}?token={token[:-1]}x"):
            assert stranger.page.request.get(wrong).status == 403
            with pytest.raises(Error, match="refused"):
                stranger.page.evaluate(
                    "address => new Promise((good, bad) => { const s = new WebSocket(address);"
                    " s.onopen = good; s.onerror = () => bad('refused') })",
                    wrong.replace("http", "ws"),
                )
        assert stranger.page.locator("canvas").count() == 0
        stranger.open(f"{address}?token={token}")
        stranger.page.locator("canvas").first.wait_for()
