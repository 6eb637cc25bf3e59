"""Browser visitor: opens a page, reads it, and presses its buttons.

Screenshots stay in `build/screenshots`.
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
from tests.support.waiting import TIMEOUT, Value, wait_until

WIDTH, HEIGHT = 1000, 640
"""Size of the window in CSS pixels."""

COARSE = 0.4
"""Drawn pixels per CSS pixel: few, since the processor draws them all."""

_DRAWN = """() => new Promise(done => requestAnimationFrame(() => {
  const [largest] = [...document.querySelectorAll('canvas')].sort((a, b) => b.width - a.width);
  done(largest && largest.width ? largest.toDataURL('image/png').split(',')[1] : '');
}))"""
"""Drawn scene as base64: much faster than a screenshot, which composes the whole window."""


_FEW_FRAMES = """
const next = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = draw => setTimeout(() => next(draw), 250);
window.cancelAnimationFrame = clearTimeout;
"""
"""Limits drawing to four frames per second instead of sixty, which would take the whole processor."""


_HIDE = """hidden => {
  Object.defineProperty(document, 'hidden', {value: hidden, configurable: true});
  document.dispatchEvent(new Event('visibilitychange'));
}"""
"""Tells the page's scripts that its tab is hidden or shown: without a display none is."""


class Visitor:
    """Window of a browser, with storage of its own.

    Args:
        context: its storage.
        scale: drawn pixels per CSS pixel.
    """

    def __init__(self, context: BrowserContext, scale: float = COARSE) -> None:
        self._context = context
        self._scale = scale
        context.add_init_script(_FEW_FRAMES)
        self.page: Page = context.new_page()
        self.page.set_default_timeout(TIMEOUT * 1e3)
        self.errors: list[str] = []
        """Errors of the page's own scripts."""
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))

    def open(self, url: str) -> None:
        """Go to a page; its scene may come later."""
        url += f"{'&' if '?' in url else '?'}fixedDpr={self._scale}"  # viser's own option; its default is at least 1
        self.page.goto(url, timeout=TIMEOUT * 1e3, wait_until="domcontentloaded")

    def close(self) -> None:
        self._context.close()

    def hide(self, *, is_hidden: bool) -> None:
        """Hide or show the tab."""
        self.page.evaluate(_HIDE, is_hidden)

    def text(self) -> str:
        """All text on the page."""
        return self.page.inner_text("body")

    def find(self, pattern: str) -> re.Match[str] | None:
        """Search a pattern in the text; `^` and `$` match at line ends."""
        return re.search(pattern, self.text(), re.MULTILINE)

    def read(self, pattern: str, within: float = TIMEOUT) -> re.Match[str]:
        """Wait for a pattern in the text.

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
        noun: str,
        *,
        seen: Callable[[], object] = lambda: "",
        within: float = TIMEOUT,
    ) -> Value:
        """Wait until a condition holds, and return its value; meanwhile the page goes on.

        Args:
            condition: called about ten times a second.
            noun: name of what is expected, for the message on failure.
            seen: returns the latest state, for that message.
            within: the limit [s].
        """

        def failed() -> str:
            self.shot("failed")
            return f"{seen()}\nerrors of the page: {self.errors}"

        return wait_until(condition, noun, seen=failed, between=lambda: self.page.wait_for_timeout(100), timeout=within)

    def canvas(self) -> Pixels:
        """Drawn scene without what lies over it; a black pixel before there is any."""
        drawn = b64decode(self.page.evaluate(_DRAWN))
        return pixels(drawn) if drawn else np.zeros((1, 1, 3), np.uint8)

    def frames(self, count: int, until: Callable[[], bool] = lambda: False) -> None:
        """Let the page draw some frames, or fewer if a condition holds earlier."""
        for _ in range(count):
            if until():
                return
            self.page.evaluate("() => new Promise(requestAnimationFrame)")

    def scene(self, min_colours: int = 8) -> Pixels:
        """Wait until a scene has appeared; return its picture.

        Args:
            min_colours: minimum of its colours.
        """
        seen: list[Pixels] = []

        def has_appeared() -> bool:
            seen.append(self.canvas())
            return len(seen) > 1 and min(variety(seen[-1]), variety(seen[-2])) >= min_colours

        self.wait(has_appeared, "scene", seen=lambda: f"{variety(seen[-1])} colours")
        return seen[-1]

    def change(self, before: Pixels, min_share: float = 0.001) -> Pixels:
        """Wait until the scene differs from a picture; return the new picture.

        Args:
            before: the picture.
            min_share: minimum share of the picture that differs.
        """
        seen = [before]

        def has_changed() -> bool:
            seen.append(self.canvas())
            return seen[-1].shape == before.shape and change(before, seen[-1]) > min_share

        self.wait(has_changed, "other scene", seen=lambda: f"{change(before, seen[-1]):.2%} of it have changed")
        return seen[-1]

    def shot(self, name: str) -> Path:
        """Keep a picture of the whole window; return its file."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        path = SCREENSHOTS / f"{name}.png"
        try:
            self._be_at_ease()
            self.page.screenshot(path=path, timeout=TIMEOUT * 1e3)
        except Error as error:  # the page has crashed: the test's own failure is more useful
            self.errors.append(str(error))
        return path

    def _be_at_ease(self) -> None:
        """Close the note that this browser draws without a graphics card: it covers the scene."""
        note = self.page.get_by_role("alert").filter(has_text="Software WebGL")
        if note.is_visible():
            note.get_by_role("button").click()
            note.wait_for(state="hidden")

    def press(self, name: str) -> None:
        """Press the button of this name."""
        self.button(name).click()

    def button(self, name: str) -> Locator:
        """Button of this name."""
        return self.page.get_by_role("button", name=name, exact=True).first
