"""Distribution of tests to workers: long ones before short ones, and waiting ones beside computing ones.

A test against ROS 1 mostly waits: for processes to start, for messages, for a cell that runs in real time. So the last
of three workers or more starts with those, while the others compute. A worker that has run out of its own kind takes
tests of the other.

Files whose tests share a cell, or something else that is slow to make, stay whole; those of the page share one browser.
"""

from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController

LESSONS = ("tests/docs/test_lesson.py", "tests/scripts/test_lesson.py")
"""Tests that play the lesson in real time, a minute and more for each."""

FOLDERS = ("tests/ros1/", "tests/middleware/ros1/host/", "tests/middleware/ros1/bridge/")
WAITING = (*LESSONS, *FOLDERS, "tests/clients/client/test_ros1.py", "tests/docs/test_ros1_page.py")

TOGETHER = "tests/browser/"
"""Tests that share a browser and its server: they all go to one worker."""

WORKSPACE = ("tests/docs/test_lesson.py::test_lesson_followed_as_pages_and_notebook", "tests/ros1/test_catkin.py")
"""Tests that share a catkin workspace: they all go to one worker, which builds it."""

SHARING = ("tests/test_packaging.py", "tests/docs/test_site.py", "tests/clients/agents/kitter/test_runs.py")
"""Files whose tests share something slow to make, which would otherwise be made once for each worker."""

WHOLE = (
    "tests/config/robot/test_against_pybullet.py",
    "tests/benchmarks/soak/test_leg.py",
    "tests/running/evaluation/execution/on_ray/test_cluster.py",
    "tests/running/evaluation/execution/test_local.py",
    "tests/recording/replay/exported/test_file.py",
    "tests/robot/checks/test_check.py",
    "tests/robot/test_poses.py",
)
"""Files whose tests share something that takes some seconds to make; they keep their place in the order."""

FIRST = (*LESSONS, "tests/ros1/test_catkin.py", *WAITING, *SHARING)
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
        return nodeid.partition("::")[0] if nodeid.startswith((*FOLDERS, *SHARING, *WHOLE)) else nodeid

    def _assign_work_unit(self, node: WorkerController) -> None:
        if self.numnodes > FEW:
            waits = node.gateway.id == f"gw{self.numnodes - 1}"
            fits = (unit for unit in self.workqueue if unit.startswith(WAITING) == waits)
            self.workqueue.move_to_end(next(fits, next(iter(self.workqueue))), last=False)
        super()._assign_work_unit(node)


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
