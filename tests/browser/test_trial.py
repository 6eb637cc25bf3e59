"""Trial on the page while the bundled agent works it, to the end; then its recording."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.browser.conftest import Visit
from tests.browser.seen import change
from tests.browser.serving import viewed
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT

pytestmark = pytest.mark.browser


def test_page_shows_score_orders_and_trays_live_and_from_recording(tmp_path: Path, visit: Visit) -> None:
    with viewed(tmp_path, "serve", "lesson", "--lockstep", "--port", "0", "--record", "run.mcap") as cell:
        visitor = visit(cell.url)
        visitor.read(r"^0\s+points")
        begin = visitor.scene()
        assert visitor.find("order_0") is None  # it is not announced yet, and this is a competition
        host, port = cell.address
        command = [sys.executable, "-m", "cellwright", "run", "--connect", f"{host}:{port}", "--no-picture"]
        agent = Process(command, os.environ, tmp_path)
        try:
            visitor.read(r"order_0_kit_0")
            visitor.read(r"piston_rod_part_\d+")  # on the tray
            visitor.read(r"^8\s+of 12 points", within=4 * TIMEOUT)  # a whole trial, which the page slows down
            visitor.read("^done$")
        finally:
            agent.kill()
        visitor.change(begin)
        visitor.page.get_by_role("tab", name="Score").click()
        visitor.read(r"lies [\d.]+ m off the tray")  # the reason for the missing points
        visitor.close()
        cell.interrupt()
    replayed(tmp_path, visit)


def test_page_of_finished_run_shows_end_of_run_and_of_page(tmp_path: Path, visit: Visit) -> None:
    """An AGV is moving at that moment: the page shows its place, and does not claim that it still moves."""
    (tmp_path / "sends.py").write_text(SENDS)
    command = ("run", "lesson", "--agent", "sends.py:Sends", "--no-picture", "--speed", "0.02")
    with viewed(tmp_path, *command) as run:
        visitor = visit(run.url)
        visitor.read("^running$")
        visitor.press("max")
        run.wait_for("^the page stays open")
        visitor.read("^delivering at the end$")
        visitor.read("the run is over: done")
        visitor.read(r"^0 of 12 points")
        visitor.read("the page shows the final state")
        assert visitor.find("^running$") is None
        assert not visitor.button("Pause").is_visible()
        assert visitor.button("Restart").is_disabled()  # it is a competition
        before = visitor.canvas()
        visitor.frames(10)
        assert change(before, visitor.canvas()) < 1e-3
        assert run.interrupt() == 0
        visitor.read("This page has ended:.* the run is over")


SENDS = """
class Sends:
    def run(self, client):
        client.start_competition()
        client.control_agv(1, "order_0_kit_0")
        client.sleep(100.0)
"""


def replayed(folder: Path, visit: Visit) -> None:
    """Page of the recording: shown from the start, and at a time clicked on its timeline."""
    with viewed(folder, "view", "run.mcap") as recording:
        visitor = visit(recording.url)
        visitor.read("^paused$")
        visitor.read(r"time \[s\]")
        early = visitor.scene()
        handle = visitor.page.get_by_role("slider").first
        handle.focus()
        handle.press("End")
        visitor.read(r"^8\s+of 12 points")
        visitor.change(early)
