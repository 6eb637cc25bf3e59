"""What the marker `browser` asks for: Chromium or Chrome, which draws without a display and without a graphics card.

Where there is none a test is skipped, with the reason; in CI it fails, so that a green build has seen the page.
"""

import os
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.required import cannot_run

VARIABLE = "CELLWRIGHT_BROWSER"
"""Names a browser other than the one that is found."""

NAMES = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser")
SCREENSHOTS = Path(__file__).parents[2] / "build" / "screenshots"
"""Where pictures of pages are kept, for people to look at."""

_FOLDER = "tests/browser/"

ARGUMENTS = (
    "--no-sandbox",  # in a container there is none to be had
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


@cache
def browser_path() -> str | None:
    """The browser's program; None where there is none."""
    named = os.environ.get(VARIABLE)
    return next((path for name in ([named] if named else NAMES) if (path := shutil.which(name))), None)


def lacking() -> str | None:
    """Why tests of pages cannot run here; None where they can."""
    if browser_path() is None:
        return f"no Chromium or Chrome: scripts/install-browser installs one, {VARIABLE} names another"
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("browser") is not None and (reason := lacking()):
        cannot_run(reason, "the page")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    shown = [each.nodeid for each in terminalreporter.stats.get("passed", []) if each.nodeid.startswith(_FOLDER)]
    if shown and (there := sorted(SCREENSHOTS.glob("*.png"))):
        terminalreporter.write_line(f"{len(there)} screenshots of pages: {SCREENSHOTS}")
