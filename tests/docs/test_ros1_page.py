"""Pages about ROS 1, followed: each `cellwright` in them is left running for the commands that come after it."""

import shlex
from pathlib import Path

import pytest

from tests.docs.pages import Command, missing, steps
from tests.ros1.ground import Ground, check_end
from tests.support.processes import Process
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ["ros1.md", "robot-node-ros1.md"]


@pytest.mark.ros1
@pytest.mark.parametrize("page", PAGES)
def test_ros1_page_followed_prints_what_it_shows(no_master: Ground, page: str) -> None:
    served: Process | None = None
    taken = [step for step in steps(DOCS / page) if isinstance(step, Command)]
    assert len(taken) >= 4
    for step in taken:
        command, *arguments = shlex.split(step.line)
        if command == "cellwright":
            if served is not None:
                check_end(served)
            served = no_master.cellwright(*arguments, "--port", "0")
            served.wait_for("^ready")
            printed = served.out
            wait_until(lambda: no_master.has_node("/rosout"), "rosout")
        else:
            printed = no_master.tool(command, *arguments, status=step.status)
        assert missing(step.output, printed) is None, f"{step.line}\n{printed}"
