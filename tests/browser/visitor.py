"""Somebody with a browser who looks at a page, reads it, and presses what is there.

Screenshots are kept in `build/screenshots`, for people to look at.
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path

import numpy as np
from playwright.sync_api import BrowserContext, Error, Locator, Page

from tests.browser.requirement import SCREENSHOTS
from tests.browser.seen import Pixels, change, pixels, variety
from tests.waiting import TIMEOUT, Value, wait_until

WIDTH, HEIGHT = 1000, 640
"""Of the window, as the page sees it [px]."""

COARSE = 0.4
"""Pixels of the screen for each of those, and pixels that are drawn: the processor draws them all."""

_DRAWN = """() => new Promise(done => requestAnimationFrame(() => {
  const [largest] = [...document.querySelectorAll('canvas')].sort((a, b) => b.width - a.width);
  done(largest && largest.width ? largest.toDataURL('image/png').split(',')[1] : '');
}))"""
"""What is drawn in three dimensions, as base64: much faster than a screenshot, which composes the whole window."""


_FEW_FRAMES = """
const next = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = draw => setTimeout(() => next(draw), 250);
window.cancelAnimationFrame = clearTimeout;
"""
"""Draws four frames a second instead of sixty: the processor draws them all, and would do nothing else."""


class Visitor:
    """One window of a browser, with nothing remembered from others.

    Args:
        context: the window's own memory.
        scale: pixels that are drawn for each that the page sees.
    """

    def __init__(self, context: BrowserContext, scale: float = COARSE) -> None:
        self._context = context
        self._scale = scale
        context.add_init_script(_FEW_FRAMES)
        self.page: Page = context.new_page()
        self.page.set_default_timeout(TIMEOUT * 1e3)
        self.errors: list[str] = []
        """What went wrong in the page's own programs."""
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))

    def open(self, url: str) -> None:
        """Go to a page; its scene may not be there yet."""
        url += f"{'&' if '?' in url else '?'}fixedDpr={self._scale}"  # viser's own: it would draw 1 at least
        self.page.goto(url, timeout=TIMEOUT * 1e3, wait_until="domcontentloaded")

    def close(self) -> None:
        self._context.close()

    def text(self) -> str:
        """All that can be read on the page."""
        return self.page.inner_text("body")

    def find(self, pattern: str) -> re.Match[str] | None:
        """A pattern in what can be read; `^` and `$` stand for ends of lines."""
        return re.search(pattern, self.text(), re.MULTILINE)

    def read(self, pattern: str, within: float = TIMEOUT) -> re.Match[str]:
        """Wait for a pattern in what can be read.

        Args:
            pattern: a regular expression.
            within: the limit [s].
        """
        found = self.wait(lambda: self.find(pattern), f"{pattern!r} on the page", seen=self.text, within=within)
        assert found is not None
        return found

    def wait(
        self,
        condition: Callable[[], Value],
        what: str,
        *,
        seen: Callable[[], object] = lambda: "",
        within: float = TIMEOUT,
    ) -> Value:
        """Wait until a condition holds, and return its value; meanwhile the page goes on.

        Args:
            condition: asked about ten times a second.
            what: noun of what is expected, for the message when it does not come.
            seen: what was seen last, for that message.
            within: the limit [s].
        """

        def failed() -> str:
            self.shot("failed")
            return f"{seen()}\nerrors of the page: {self.errors}"

        return wait_until(condition, what, seen=failed, between=lambda: self.page.wait_for_timeout(100), timeout=within)

    def canvas(self) -> Pixels:
        """What is drawn in three dimensions, without what lies over it; a black pixel before there is anything."""
        drawn = b64decode(self.page.evaluate(_DRAWN))
        return pixels(drawn) if drawn else np.zeros((1, 1, 3), np.uint8)

    def frames(self, count: int, until: Callable[[], bool] = lambda: False) -> None:
        """Let the page draw some frames, or fewer when a condition holds before."""
        for _ in range(count):
            if until():
                return
            self.page.evaluate("() => new Promise(requestAnimationFrame)")

    def scene(self, least: int = 8) -> Pixels:
        """Wait until a scene has appeared; what is seen then.

        Args:
            least: how many colours it has.
        """
        seen: list[Pixels] = []

        def has_appeared() -> bool:
            seen.append(self.canvas())
            return len(seen) > 1 and min(variety(seen[-1]), variety(seen[-2])) >= least

        self.wait(has_appeared, "scene", seen=lambda: f"{variety(seen[-1])} colours")
        return seen[-1]

    def change(self, before: Pixels, least: float = 0.001) -> Pixels:
        """Wait until the scene is seen to be another than it was.

        Args:
            before: as it was.
            least: the share of the picture that is another.
        """
        seen = [before]

        def has_changed() -> bool:
            seen.append(self.canvas())
            return seen[-1].shape == before.shape and change(before, seen[-1]) > least

        self.wait(has_changed, "other scene", seen=lambda: f"{change(before, seen[-1]):.2%} of it have changed")
        return seen[-1]

    def shot(self, name: str) -> Path:
        """Keep a picture of the whole window; the file."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        path = SCREENSHOTS / f"{name}.png"
        try:
            self._be_at_ease()
            self.page.screenshot(path=path, timeout=TIMEOUT * 1e3)
        except Error as error:  # the page has crashed: what the test has to say is worth more
            self.errors.append(str(error))
        return path

    def _be_at_ease(self) -> None:
        """Put away the note that this browser draws without a graphics card: it lies over the scene."""
        note = self.page.get_by_role("alert").filter(has_text="Software WebGL")
        if note.is_visible():
            note.get_by_role("button").click()
            note.wait_for(state="hidden")

    def press(self, name: str) -> None:
        """Press the button of this name."""
        self.button(name).click()

    def button(self, name: str) -> Locator:
        """The button of this name."""
        return self.page.get_by_role("button", name=name, exact=True).first
