"""Distribution of tests to workers: long ones before short ones, and waiting ones beside computing ones.

A test against ROS mostly waits: for processes to start, for messages, for a cell that runs in real time. So of three
workers one starts with those of ROS 1, and of four another one with those of ROS 2 and Ray, while the others compute. A
worker that has run out of its own kind takes tests of the other.

Files with a fixture for the whole module stay whole: else each worker would make it for itself. Those of the page share
one browser.
"""

import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController

ROOT = Path(__file__).parents[2]

LESSONS = ("tests/docs/test_lesson.py", "tests/scripts/test_lesson.py")
"""Tests that play the lesson in real time, a minute and more for each."""

FOLDERS = ("tests/ros1/", "tests/middleware/ros1/host/", "tests/middleware/ros1/bridge/")
"""Tests that share a ROS 1 master and cells in it."""

RAY = "tests/running/evaluation/execution/on_ray/"
ROS1 = (*LESSONS, *FOLDERS, "tests/clients/client/test_ros1_transport.py", "tests/docs/test_ros1_page.py")
ROS2 = ("tests/ros2/", "tests/middleware/ros2/host/", "tests/benchmarks/test_ros2.py", RAY)
WAITING = (ROS1, ROS2)
"""Tests that wait, for each worker that begins with such tests, from the last on."""

TOGETHER = "tests/browser/"
"""Tests that share a browser and its server: they all go to one worker."""

WORKSPACE = ("tests/docs/test_lesson.py::test_lesson_followed_as_pages_and_notebook", "tests/ros1/test_catkin.py")
"""Tests that share a catkin workspace: they all go to one worker, which builds it."""

SLOW = ("tests/test_packaging.py", "tests/docs/test_site.py", "tests/clients/agents/kitter/test_runs.py")
"""Files that begin with something slow."""

WHOLE = (RAY, "tests/running/evaluation/execution/test_local.py", *FOLDERS)
"""Files and folders whose fixtures are elsewhere, and which stay whole, too."""

FIRST = (*LESSONS, "tests/ros1/test_catkin.py", *ROS1, *SLOW)
"""First tests, in this order, so that the slow ones are not the last."""

FEW = 2
"""Number of workers up to which all of them do everything, in order."""


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]  # xdist says no types
    """Work units for xdist, in the order in which they were collected."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        super().__init__(config, log)
        config.option.loadscopereorder = False

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(TOGETHER):
            return TOGETHER
        if nodeid.startswith(WORKSPACE):
            return WORKSPACE[0]
        file = nodeid.partition("::")[0]
        return file if nodeid.startswith(WHOLE) or _has_module_fixture(file) else nodeid

    def _assign_work_unit(self, node: WorkerController) -> None:
        if self.numnodes > FEW:
            kinds = WAITING[: self.numnodes - FEW]
            from_last = self.numnodes - 1 - int(node.gateway.id.removeprefix("gw"))
            kind = kinds[from_last] if from_last < len(kinds) else None
            fits = (unit for unit in self.workqueue if _kind(unit, kinds) == kind)
            self.workqueue.move_to_end(next(fits, next(iter(self.workqueue))), last=False)
        super()._assign_work_unit(node)


def _kind(unit: str, kinds: tuple[tuple[str, ...], ...]) -> tuple[str, ...] | None:
    """Return which of the kinds that have a worker of their own a unit is of; None for none."""
    return next((kind for kind in kinds if unit.startswith(kind)), None)


@cache
def _has_module_fixture(file: str) -> bool:
    path = ROOT / file
    return path.is_file() and re.search(r'scope="(module|package)"', path.read_text(encoding="utf-8")) is not None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling | None:
    return Scheduling(config, log) if config.getoption("dist") == "load" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put tests in order; those of the page go to the middle.

    A browser without a graphics card draws with all cores, and would starve the lessons, which come first.
    """
    items.sort(key=lambda item: next((place for place, name in enumerate(FIRST) if item.nodeid.startswith(name)), 99))
    page = [item for item in items if item.nodeid.startswith(TOGETHER)]
    others = [item for item in items if not item.nodeid.startswith(TOGETHER)]
    begun = sum(item.nodeid.startswith(FIRST) for item in others)
    middle = (begun + len(others)) // 2
    items[:] = [*others[:middle], *page, *others[middle:]]
