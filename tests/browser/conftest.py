"""Fixtures for tests of pages: a shared browser, and visitors in it.

A test that uses them has the marker `browser`. The browser runs only as long as the tests of this folder: its event
loop would disturb others.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from playwright.sync_api import Browser, Error, ViewportSize, sync_playwright

from cellwright.viewer.web.scene import PLAIN
from tests.browser.requirement import ARGUMENTS, browser_path
from tests.browser.visitor import COARSE, HEIGHT, WIDTH, Visitor
from tests.support.waiting import TIMEOUT

Visit = Callable[..., Visitor]
"""Opens a page in its own window: `visit(url)`, or `visit(url, scale=1.0)` for a full-size picture."""


@pytest.fixture(scope="package", autouse=True)
def plain() -> Iterator[None]:
    """Pages without shadows, which the processor would have to draw."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(PLAIN, "1")
        yield


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Chromium without a display."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_path(), args=[*ARGUMENTS], timeout=TIMEOUT * 1e3, chromium_sandbox=False
        )
        yield browser
        browser.close()


@contextmanager
def visiting(browser: Browser, name: str) -> Iterator[Visit]:
    """Yield a `Visit`; at the end check each page for errors, and keep its screenshot in `build/screenshots`.

    Args:
        browser: the browser for the windows.
        name: prefix of the screenshots.
    """
    visitors: list[Visitor] = []

    def visit(url: str, scale: float = COARSE) -> Visitor:
        window: ViewportSize = {"width": WIDTH, "height": HEIGHT}
        visitor = Visitor(browser.new_context(viewport=window, device_scale_factor=scale), scale)
        visitors.append(visitor)
        visitor.open(url)
        return visitor

    yield visit
    errors = []
    for number, visitor in enumerate(each for each in visitors if not each.page.is_closed()):
        visitor.shot(f"{name}-{number + 1}" if len(visitors) > 1 else name)
        errors += visitor.errors
        with suppress(Error):
            visitor.close()
    assert not errors


@pytest.fixture
def visit(browser: Browser, request: pytest.FixtureRequest) -> Iterator[Visit]:
    """Visits for one test."""
    with visiting(browser, request.node.name.removeprefix("test_")) as visit:
        yield visit


@pytest.fixture(scope="module")
def visit_all(browser: Browser, request: pytest.FixtureRequest) -> Iterator[Visit]:
    """Visits for all tests of a file: opening a page takes longer than most of them."""
    name = str(request.path.stem).removeprefix("test_")
    with visiting(browser, name) as visit:
        yield visit
