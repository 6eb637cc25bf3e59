"""Requirement of the marker `browser`: Chromium or Chrome, without a display or graphics card.

Without one a test is skipped, with the reason; in CI it fails, so that a green build has tested the page.
"""

import os
import shutil
from ctypes.util import find_library
from functools import cache
from pathlib import Path

VARIABLE = "CELLWRIGHT_BROWSER"
"""Environment variable that names another browser than the one found."""

NAMES = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser")
SCREENSHOTS = Path(__file__).parents[2] / "build" / "screenshots"
"""Folder for pictures of pages."""

ARGUMENTS = (
    "--no-sandbox",  # a container has none
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    # Mesa draws a frame in a sixth of the processor time of the browser's own SwiftShader
    *(
        ("--use-angle=gl-egl", "--ignore-gpu-blocklist", "--enable-gpu")
        if find_library("EGL")
        else ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    ),
)


@cache
def browser_path() -> str | None:
    """Path of the browser; None if there is none."""
    named = os.environ.get(VARIABLE)
    return next((path for name in ([named] if named else NAMES) if (path := shutil.which(name))), None)


def lacking() -> str | None:
    """Return why tests of pages cannot run here; None if they can."""
    if browser_path() is None:
        return f"no Chromium or Chrome: scripts/install-browser installs one, {VARIABLE} names another"
    return None
