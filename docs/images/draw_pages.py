"""Draws the pictures of the pages with Chromium: python docs/images/draw_pages.py."""

import os
import re
import sys
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, ViewportSize, sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.browser.requirement import ARGUMENTS, browser_path  # noqa: E402
from tests.browser.visitor import Visitor  # noqa: E402
from tests.processes import Process  # noqa: E402


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
        visitor.page.locator(".mantine-Notification-closeButton").click()  # of viser's note on software rendering
        visitor.page.mouse.move(5, 5)  # so that no button shows its hint
        visitor.frames(20)  # shadows and handles come last
        drawn = Image.open(BytesIO(visitor.page.screenshot(timeout=120_000))).convert("RGB")
        drawn.save(ROOT / "docs" / "images" / picture, quality=88)
        visitor.close()
    finally:
        process.kill()


def main() -> None:
    """Draw all pages."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_path(), args=[*ARGUMENTS], timeout=120e3, chromium_sandbox=False
        )
        draw(browser, ("run", "lesson", "--no-picture", "--speed", "1"), (1280, 800), 30.0, "page.jpg")
        draw(browser, ("teleop", "qinglong", "--port", "0"), (1280, 800), 2.0, "page-robot.jpg")
        operator = "browser-operator.png"
        draw(browser, ("teleop", "qinglong", "--port", "0"), (1000, 680), 2.0, operator, opened="Right arm")
        browser.close()


if __name__ == "__main__":
    main()
