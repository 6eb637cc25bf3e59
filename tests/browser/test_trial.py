"""A trial on the page while the bundled agent works it: what the page says changes until the end."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.browser.conftest import Visit
from tests.browser.serving import viewed
from tests.ros1.processes import Process

pytestmark = pytest.mark.browser


def test_score_orders_and_trays_change_until_the_end(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "serve", "lesson", "--lockstep", "--port", "0") as cell:
        onlooker = visit(cell.url)
        onlooker.read(r"^0\nof 12 points")
        assert onlooker.find("order_0") is None  # it has not been announced, and this is a competition
        host, port = cell.address
        command = [sys.executable, "-m", "cellwright", "run", "--connect", f"{host}:{port}", "--no-picture"]
        agent = Process(command, os.environ, tmp_path)
        try:
            onlooker.read(r"order_0_kit_0")
            onlooker.read(r"piston_rod_part_\d+")  # on the tray
            onlooker.read(r"^8\nof 12 points", within=240.0)
            onlooker.read("^done$")
        finally:
            agent.kill()
        onlooker.page.get_by_role("tab", name="Score").click()
        assert "lies off the tray" in onlooker.read(r".*lies .* off the tray.*")[0]  # why there are no more
