"""Page in its own process, with a server and viewers: nothing is drawn here."""

import json
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.server import Server
from cellwright.rendering.scene import SceneFrame
from cellwright.robot.node import RobotNode
from cellwright.util.errors import UsageError
from cellwright.viewer.services.names import PANEL, VIEWER_SERVICES
from cellwright.viewer.services.scene import SceneServices, ServedScene, ViewedNode
from cellwright.viewer.web.start import WebPage, page_source
from tests.robot.robots import two_arms
from tests.support.cells import KITTING, WHOLE
from tests.support.quick_children import QUICK_PAGES
from tests.support.waiting import TIMEOUT, wait_until
from tests.viewer.web.fake_viewer import FakeViewer

TRAY = "bodies/agv1::kit_tray_1::kit_tray_1::tray"


class CountedScene(ServedScene):
    """Scene that counts its frames."""

    frames = 0

    def frame(self) -> SceneFrame:
        self.frames += 1
        return super().frame()


class Hall:
    """Server, and a page on it."""

    def __init__(self, served: ViewedNode, port: int = 0, *, guarded: Sequence[str] = ()) -> None:
        self.served = served
        self.server = Server(served, port=port)
        if guarded:
            self.server.guard(guarded, "not for you")
        self.scene = CountedScene(served)
        self.panels: list[dict[str, Any]] = []
        """Requests for a panel."""
        SceneServices(self.scene, self._panel).offer(self.server)
        self.server.offer(PANEL, self._panel)

    @property
    def frames(self) -> int:
        """Number of frames taken for pages."""
        return self.scene.frames

    @property
    def is_streaming(self) -> bool:
        """True while a page gets frames."""
        return self.server._streams.due < math.inf

    def _panel(self, request: dict[str, Any]) -> dict[str, Any]:
        self.panels.append(request)
        return {"kind": "none"}

    def until(self, condition: Callable[[], object]) -> None:
        """Step and serve until a condition holds."""
        wait_until(condition, "change on the page", seen=lambda: f"{self.frames} frames", between=self.step)

    def step(self) -> None:
        """Step once, and serve."""
        self.served.simulation.step()
        self.server.wait(0.001)


@contextmanager
def shown(served: ViewedNode) -> Iterator[tuple[Hall, WebPage]]:
    hall = Hall(served)
    page = WebPage(page_source(hall.server.address), port=0)
    try:
        yield hall, page
    finally:
        page.close()
        hall.server.close("the test is over")
    assert not page.is_running


@QUICK_PAGES
@pytest.mark.slow
def test_pages_leave_state_unchanged_and_late_browser_sees_present() -> None:
    watched, alone = Cell(WHOLE), Cell(WHOLE)
    with shown(watched) as (hall, page):
        first = FakeViewer(page.url)
        hall.until(lambda: first.sees(TRAY, "bodies/world", "shadows/0"))
        hall.until(lambda: first.moves > 30)
        late = FakeViewer(page.url)
        hall.until(lambda: late.sees(TRAY) and abs(late.position(TRAY)[1] - 3.0) < 0.5)
        for _ in range(20):
            hall.step()
        assert hall.frames > 5
        first.close()
        late.close()
        ticks = watched.simulation.clock.tick
    for _ in range(ticks):
        alone.step()
    assert watched.state_hash() == alone.state_hash()


@QUICK_PAGES
@pytest.mark.slow
def test_page_with_key_is_answered_and_others_are_refused() -> None:
    hall = Hall(Cell(KITTING), guarded=VIEWER_SERVICES)
    own = WebPage(page_source(hall.server.address, hall.server.key), port=0)
    other = WebPage(page_source(hall.server.address), port=0)
    try:
        own_viewer, other_viewer = FakeViewer(own.url), FakeViewer(other.url)
        hall.until(lambda: own_viewer.sees(TRAY))
        hall.until(lambda: any("not for you" in text for text in other_viewer.texts))
        assert not other_viewer.sees(TRAY)
        own_viewer.close()
        other_viewer.close()
    finally:
        own.close()
        other.close()
        hall.server.close("the test is over")


@QUICK_PAGES
@pytest.mark.slow
def test_page_without_browser_requests_few_panels() -> None:
    """Its panel requests are counted here; the tests of `StatePoller` cover the pauses between two polls."""
    with shown(Cell(KITTING)) as (hall, page):
        hall.until(lambda: hall.frames >= 3)
        assert len(hall.panels) <= 2  # those of its features for another scene
        before = hall.frames
        viewer = FakeViewer(page.url)
        hall.until(lambda: hall.frames > before + 10)
        hall.until(lambda: len(hall.panels) > 4)
        viewer.close()


@QUICK_PAGES
@pytest.mark.slow
def test_hidden_tab_gets_nothing_and_present_once_it_is_shown() -> None:
    with shown(Cell(WHOLE)) as (hall, page):
        hidden, seen = FakeViewer(page.url), FakeViewer(page.url)
        hall.until(lambda: hidden.moves > 5 and seen.moves > 5)
        hidden.hide(is_hidden=True)
        hall.until(lambda: seen.moves > hidden.moves + 200)
        moves = hidden.moves
        seen.hide(is_hidden=True)
        hall.until(lambda: not hall.is_streaming)
        hidden.hide(is_hidden=False)
        hall.until(lambda: hall.is_streaming)
        hall.until(lambda: hidden.moves > moves + 5)
        hidden.close()
        hall.until(lambda: not hall.is_streaming)
        seen.close()


@QUICK_PAGES
@pytest.mark.slow
def test_page_reconnects_and_shows_restarted_server() -> None:
    hall = Hall(Cell(KITTING))
    port = hall.server.address[1]
    page = WebPage(page_source(hall.server.address), port=0)
    try:
        viewer = FakeViewer(page.url)
        hall.until(lambda: viewer.sees(TRAY))
        hall.server.close("the run is over")
        wait_until(
            lambda: any("Not connected" in text and "the run is over" in text for text in viewer.texts),
            "notice that the cell is gone",
            seen=lambda: viewer.texts,
        )
        hall = Hall(RobotNode(two_arms()), port)
        hall.until(lambda: viewer.sees("bodies/world") and not viewer.sees(TRAY))
        viewer.close()
    finally:
        page.close()
        hall.server.close("the test is over")


@QUICK_PAGES
@pytest.mark.slow
def test_ended_page_leaves_reason_in_browser() -> None:
    """The text that stays in a browser's window says that it is not current."""
    hall = Hall(Cell(KITTING))
    page = WebPage(page_source(hall.server.address), port=0)
    viewer = FakeViewer(page.url)
    hall.until(lambda: viewer.sees(TRAY))
    hall.server.close("the node has stopped")

    def wait_for(words: str) -> None:
        wait_until(lambda: any(words in text for text in viewer.texts), words, seen=lambda: viewer.texts)

    wait_for("**Not connected:** the node has stopped.")
    page.close()
    wait_for("**This page has ended:** the node has stopped.")
    viewer.close()


@QUICK_PAGES
@pytest.mark.slow
def test_killed_page_does_not_affect_second_page() -> None:
    with shown(Cell(KITTING)) as (hall, page):
        other = WebPage(page_source(hall.server.address), port=0)
        ones, others = FakeViewer(page.url), FakeViewer(other.url)
        hall.until(lambda: ones.sees(TRAY) and others.sees(TRAY))
        other._process.kill()
        hall.until(lambda: not other.is_running)
        other.close()
        requests = hall.frames
        hall.until(lambda: hall.frames > requests + 10)
        ones.close()


@QUICK_PAGES
@pytest.mark.slow
def test_invalid_messages_of_browser_change_nothing_for_others() -> None:
    with shown(Cell(KITTING)) as (hall, page):
        good = FakeViewer(page.url)
        hall.until(lambda: good.sees(TRAY))
        for nonsense in (
            b"\xff" * 40,
            {"type": "NoSuchMessage"},
            {"type": "ShareUrlRequest"},
            {"type": "GuiUpdateMessage", "uuid": "nobody", "updates": {"value": [1] * 100}},
            {"type": "GuiUpdateMessage", "uuid": 7, "updates": 7},
            {"type": "ViewerCameraMessage", "wxyz": "x"},
            {"type": "SceneNodeClickMessage"},
            {"type": "TransformControlsUpdateMessage", "name": "/scene", "wxyz": (0, 0, 0, 0), "position": (1, 2)},
        ):
            bad = FakeViewer(page.url)
            bad.send(nonsense)
            for _ in range(10):
                hall.step()
            bad.close()
        moves = hall.frames
        hall.until(lambda: hall.frames > moves + 10)
        assert page.is_running
        late = FakeViewer(page.url)
        hall.until(lambda: late.sees(TRAY))
        late.close()
        good.close()


@QUICK_PAGES
@pytest.mark.slow
def test_page_on_network_without_token_is_refused() -> None:
    with pytest.raises(UsageError, match=r"page cannot start: .*requires a token"):
        WebPage(page_source(("127.0.0.1", 1)), host="0.0.0.0", port=0)


@pytest.mark.slow
def test_on_gone_is_called_for_killed_page_and_not_for_closed_one() -> None:
    gone = threading.Event()
    page = WebPage(page_source(("127.0.0.1", 1)), port=0, on_gone=gone.set)
    os.kill(page._process.pid, signal.SIGTERM)
    assert gone.wait(TIMEOUT)
    assert not page.is_running
    page.close()

    gone.clear()
    before = threading.enumerate()
    page = WebPage(page_source(("127.0.0.1", 1)), port=0, on_gone=gone.set)
    page.close()
    assert not page.is_running
    wait_until(lambda: {*threading.enumerate()} <= {*before}, "end of the thread that watches the page")
    assert not gone.is_set()


@pytest.mark.slow
def test_page_of_ended_parent_ends_silently() -> None:
    command = [sys.executable, "-P", "-m", "cellwright.viewer.web.program"]
    options = {"source": page_source(("127.0.0.1", 1)), "host": "127.0.0.1", "port": 0}
    reader, writer = os.pipe()
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    os.close(reader)

    _, output = process.communicate(json.dumps(options).encode() + b"\n", timeout=TIMEOUT)

    assert (process.returncode, output) == (0, b"")
