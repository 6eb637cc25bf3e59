"""Visitor of pages, on a page with known content."""

import threading
from collections.abc import Iterator

import pytest
import viser

from tests.browser.conftest import Visit
from tests.browser.seen import Hues, middle, pixels, share
from tests.browser.visitor import COARSE, HEIGHT, WIDTH
from tests.support.ports import free_port

pytestmark = pytest.mark.browser

GREEN = Hues(120.0)


@pytest.fixture(scope="module")
def page() -> Iterator[str]:
    """Green box, text, and a button that changes the text."""
    server = viser.ViserServer(host="127.0.0.1", port=(port := free_port()), verbose=False)
    server.scene.add_box("/box", dimensions=(1, 1, 1), color=(20, 200, 40))
    text = server.gui.add_markdown("waiting")

    @server.gui.add_button("Go").on_click
    def _(_event: object) -> None:
        threading.Timer(0.3, lambda: setattr(text, "content", "gone after **2.5 s**")).start()

    yield f"http://127.0.0.1:{port}/"
    server.stop()


def test_visitor_sees_reads_presses_and_reports_timeout(page: str, visit: Visit) -> None:
    visitor = visit(page)
    visitor.read("^waiting$")
    picture = visitor.scene(min_colours=3)
    assert picture.shape == (HEIGHT * COARSE, WIDTH * COARSE, 3)
    assert 0.01 < share(picture, GREEN) < 0.1
    assert middle(picture, GREEN) == pytest.approx((0.5, 0.5), abs=0.05)
    visitor.press("Go")
    assert visitor.read(r"gone after (\S+) s")[1] == "2.5"
    assert share(pixels(visitor.shot("a_green_box")), GREEN) == pytest.approx(share(picture, GREEN), rel=0.2)
    with pytest.raises(AssertionError, match=r"(?s)no 'nowhere' on the page within 0.2 s; last seen:.*Go"):
        visitor.read("nowhere", within=0.2)
