"""The page about ROS 1, followed: each `cellwright serve` in it is left running for the commands that come after it."""

import shlex
from pathlib import Path

import pytest

from tests.docs.pages import Command, missing, steps
from tests.ros1.ground import Ground, check_end
from tests.ros1.processes import Process
from tests.ros1.waiting import until

PAGE = Path(__file__).parents[2] / "docs" / "ros1.md"


@pytest.mark.ros1
def test_the_page_can_be_followed(no_master: Ground) -> None:
    served: Process | None = None
    taken = [step for step in steps(PAGE) if isinstance(step, Command)]
    assert len(taken) >= 6
    for step in taken:
        command, *arguments = shlex.split(step.line)
        if command == "cellwright":
            if served is not None:
                check_end(served)
            served = no_master.cellwright(*arguments, "--port", "0")
            served.wait_for("^ready", 15.0)
            printed = served.out
            until(lambda: "/rosout" in no_master.tool("rosnode", "list"), 15.0, "rosout")
        else:
            printed = no_master.tool(command, *arguments, status=step.status)
        assert missing(step.output, printed) is None, f"{step.line}\n{printed}"
