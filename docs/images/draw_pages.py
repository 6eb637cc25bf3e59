"""Draws the pictures of the pages with Chromium: python docs/images/draw_pages.py [evaluation.png …]."""

import os
import re
import sys
from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from playwright.sync_api import Browser, ViewportSize, sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.browser.requirement import ARGUMENTS, browser_path  # noqa: E402
from tests.browser.visitor import Visitor  # noqa: E402
from tests.support.processes import Process  # noqa: E402


def draw(
    browser: Browser, command: tuple[str, ...], size: tuple[int, int], at: float, picture: str, *, opened: str = ""
) -> None:
    """Run a command with a page, and store a screenshot of the page in JPEG or PNG.

    Args:
        browser: the browser.
        command: words of the command, without `cellwright`.
        size: width and height of the window [pixels].
        at: simulation time of the picture [s]; the cell is paused there.
        picture: name of the file.
        opened: group of sliders to open.
    """
    words = [sys.executable, "-m", "cellwright", *command, "--view", "--view-port", "0"]
    process = Process(words, os.environ, ROOT)
    try:
        window: ViewportSize = {"width": size[0], "height": size[1]}
        visitor = Visitor(browser.new_context(viewport=window), scale=1.0)
        visitor.open(process.wait_for(r"^page: (http://\S+)$")[1])
        visitor.wait(
            lambda: any(float(each) >= at for each in re.findall(r"\b(\d+\.\d\d) *s", visitor.text())),
            "time on the page",
        )
        if "run" in command:
            visitor.press("Pause")
        if opened:
            visitor.page.get_by_text(opened).click()
        save(visitor, picture)
    finally:
        process.kill()


_ROBOT = """
import logging
from cellwright.clients.agents.kitter.agent import KitterAgent

class NoMotion(Exception):
    pass

class Robot(KitterAgent):
    def run(self, client):
        set_status = client.set_status

        def check(text):
            set_status(text)
            if text.startswith("turning"):
                raise NoMotion(text)

        client.set_status = check
        try:
            super().run(client)
        except NoMotion as error:
            logging.getLogger("robot").error("%.1f s: %s: there is no motion for this yet", client.time, error)
"""
"""Program that cannot turn a pulley over, as two of these trials want."""

_TRIALS = ("final01", "final02", "final03", "qual3b")


def draw_evaluation(browser: Browser, picture: str) -> None:
    """Store a screenshot of the page of an evaluation in progress."""
    with TemporaryDirectory() as folder:
        Path(folder, "robot.py").write_text(_ROBOT, encoding="utf-8")
        work = ("eval", *_TRIALS, "--agent", "robot.py:Robot", "--seeds", "25", "--vary", "--view", "--view-port", "0")
        process = Process([sys.executable, "-m", "cellwright", *work], os.environ, Path(folder))
        try:
            visitor = Visitor(browser.new_context(viewport={"width": 1280, "height": 800}), scale=1.0)
            visitor.open(process.wait_for(r"^page: (http://\S+)$")[1])
            visitor.read(r"^[3-9]\d ?\n?of 100 runs")
            visitor.page.get_by_role("tab", name="Failures").click()
            visitor.page.locator("input[role=combobox]:visible").click()
            visitor.page.get_by_role("option").filter(has_text="qual3b").first.click()
            visitor.read(r"view: qual3b seed \d+ at its end")
            save(visitor, picture)
        finally:
            process.kill()


def save(visitor: Visitor, picture: str) -> None:
    """Store a screenshot of a page in JPEG or PNG, and close it."""
    visitor.page.locator(".mantine-Notification-closeButton").click()  # of viser's note on software rendering
    visitor.page.mouse.move(5, 5)  # so that no button shows its hint
    visitor.frames(20)  # shadows and handles come last
    drawn = Image.open(BytesIO(visitor.page.screenshot(timeout=120_000))).convert("RGB")
    drawn.save(ROOT / "docs" / "images" / picture, quality=88)
    visitor.close()


def main() -> None:
    """Draw all pages, or those whose pictures are arguments."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_path(), args=[*ARGUMENTS], timeout=120e3, chromium_sandbox=False
        )
        run, teleop = ("run", "lesson", "--no-picture", "--speed", "1"), ("teleop", "qinglong", "--port", "0")
        pages: dict[str, Callable[[str], None]] = {
            "page.jpg": partial(draw, browser, run, (1280, 800), 30.0),
            "page-robot.jpg": partial(draw, browser, teleop, (1280, 800), 2.0),
            "browser-operator.png": partial(draw, browser, teleop, (1000, 680), 2.0, opened="Right arm"),
            "evaluation.png": partial(draw_evaluation, browser),
        }
        for name in sys.argv[1:] or pages:
            pages[name](name)
        browser.close()


if __name__ == "__main__":
    main()
