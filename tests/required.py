"""What tests need of the machine: without it they are skipped with the reason, and in CI they fail."""

from __future__ import annotations

import importlib.util
import os
import shutil
from importlib import import_module
from typing import NoReturn

import pytest

MARKERS = {"ros1": "real ROS 1", "browser": "the page", "display": "a real window"}
"""Markers of tests that need more than Python, and what CI has to see of each."""


def reason_to_skip(marker: str) -> str | None:
    """What the tests of a marker lack here; None where they can run."""
    if marker == "display":
        if shutil.which("Xvfb") is None or importlib.util.find_spec("glfw") is None:
            return "no Xvfb or no glfw: scripts/install-display and the extra `gui` bring them"
        return None
    reason: str | None = import_module(f"tests.{marker}.requirement").lacking()
    return reason


def cannot_run(reason: str, sight: str) -> NoReturn:
    """Skip a test; or fail it in CI, so that a green build has seen all that there is to see.

    Args:
        reason: what lacks here.
        sight: what CI has to see.
    """
    if os.environ.get("CI", "") not in ("", "0", "false"):
        pytest.fail(f"CI has to see {sight}, but there is {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    for marker, sight in MARKERS.items():
        if item.get_closest_marker(marker) is not None and (reason := reason_to_skip(marker)):
            cannot_run(reason, sight)
