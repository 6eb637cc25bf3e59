"""Tests against ROS 1 go to the workers file by file, since those of one file share a cell; all others one by one."""

from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

FILE_BY_FILE = "tests/ros1/"


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]  # xdist says no types
    """Work units for xdist."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.partition("::")[0] if nodeid.startswith(FILE_BY_FILE) else nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling | None:
    return Scheduling(config, log) if config.getoption("dist") == "load" else None
