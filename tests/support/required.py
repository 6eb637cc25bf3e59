"""Requirements of tests on the machine: without them a test is skipped with the reason, and in CI it fails."""

from __future__ import annotations

import importlib.util
import os
import shutil
from importlib import import_module
from typing import NoReturn

import pytest

MARKERS = {
    "ros1": "real ROS 1",
    "ros2": "real ROS 2",
    "urdfdom": "ROS's parser of URDF",
    "browser": "the page",
    "display": "a real window",
}
"""Markers of tests that need more than Python, and what CI must run of each."""


def reason_to_skip(marker: str) -> str | None:
    """Return what the tests of a marker lack here; None if they can run."""
    if marker == "display":
        if shutil.which("Xvfb") is None or importlib.util.find_spec("glfw") is None:
            return "no Xvfb or no glfw: scripts/install-display and the extra `gui` bring them"
        return None
    module = "tests.support.urdfdom" if marker == "urdfdom" else f"tests.{marker}.requirement"
    reason: str | None = import_module(module).lacking()
    return reason


def cannot_run(reason: str, sight: str) -> NoReturn:
    """Skip a test; or fail it in CI, so that a green build has run everything.

    Args:
        reason: the lack of this machine.
        sight: test that CI must run.
    """
    if os.environ.get("CI", "") not in ("", "0", "false"):
        pytest.fail(f"CI has to see {sight}, but there is {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    for marker, sight in MARKERS.items():
        if item.get_closest_marker(marker) is not None and (reason := reason_to_skip(marker)):
            cannot_run(reason, sight)
