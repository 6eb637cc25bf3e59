"""What the marker `browser` asks for: Chromium or Chrome, which draws without a display and without a graphics card.

Where there is none a test is skipped, with the reason; in CI it fails, so that a green build has seen the page.
"""

import os
import shutil
from ctypes.util import find_library
from functools import cache
from pathlib import Path

VARIABLE = "CELLWRIGHT_BROWSER"
"""Names a browser other than the one that is found."""

NAMES = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser")
SCREENSHOTS = Path(__file__).parents[2] / "build" / "screenshots"
"""Where pictures of pages are kept, for people to look at."""

ARGUMENTS = (
    "--no-sandbox",  # in a container there is none to be had
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    # Mesa draws a frame in a sixth of the processor time that the browser's own SwiftShader takes
    *(
        ("--use-angle=gl-egl", "--ignore-gpu-blocklist", "--enable-gpu")
        if find_library("EGL")
        else ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    ),
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
