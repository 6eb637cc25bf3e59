"""How tests go to the workers: those against ROS 1 file by file, since they share a cell, and before the short ones.

So do those of the page, since they share a browser.
"""

from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

FOLDERS = ("tests/ros1/", "tests/ros1_host/", "tests/bridges/ros1/")
TOGETHER = "tests/browser/"
"""Its tests share a browser and what it looks at: they all go to one worker."""

LONGEST = "tests/ros1/test_catkin.py"
"""It compiles for a minute, so that the other worker has to do the rest of ROS 1 meanwhile."""


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]  # xdist says no types
    """Work units for xdist, in the order in which they were collected."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        super().__init__(config, log)
        config.option.loadscopereorder = False

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(TOGETHER):
            return TOGETHER
        return nodeid.partition("::")[0] if nodeid.startswith(FOLDERS) else nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling | None:
    return Scheduling(config, log) if config.getoption("dist") == "load" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: (not item.nodeid.startswith(LONGEST), not item.nodeid.startswith((*FOLDERS, TOGETHER))))
