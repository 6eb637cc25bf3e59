"""The page on ROS 2: its program works a served cell."""

import re
from pathlib import Path

import pytest

from cellwright.cell.interface.rows import CONTROLLER_NAMES
from tests.ros2.ground import Ground
from tests.ros2.requirement import installation
from tests.support.processes import Process

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

PAGE = (Path(__file__).parents[2] / "docs" / "ros2.md").read_text(encoding="utf-8")


def test_table_of_names_is_that_of_the_cell() -> None:
    table = PAGE[PAGE.index("| name of 2017 |") :].partition("\n\n")[0]
    assert dict(re.findall(r"^\| `([^`]+)` \| `([^`]+)` \|$", table, re.MULTILINE)) == CONTROLLER_NAMES


def test_program_of_page_starts_competition(domain: Ground) -> None:
    (text,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    program = domain.folder / "student.py"
    program.write_text(text)
    cell = domain.serve("lesson", "-d")
    cell.wait_for(rf"^ready: lesson at .*, ROS 2 in domain {domain.domain}$")
    found = installation()
    assert found is not None
    process = Process([found.python, str(program)], domain.environment, domain.folder)
    assert process.finish() == 0, process.said
    first, order, joints = process.out.splitlines()
    assert first == "competition started successfully!"
    assert order == "order_0 with 4 parts"
    assert "'elbow_joint'" in joints
