"""The lesson in ROS 2: the program of the page brings a part to a tray, and prints what the page shows."""

import re
from pathlib import Path

import pytest

from tests.ros2.ground import Ground
from tests.ros2.requirement import installation
from tests.support.processes import Process

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

PAGE = (Path(__file__).parents[2] / "docs" / "lesson-ros2.md").read_text(encoding="utf-8")
SPEED = "4"


@pytest.mark.slow
def test_program_of_page_brings_part_and_prints_what_page_shows(domain: Ground) -> None:
    (text,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (shown,) = re.findall(r"\$ python3 tasker.py\n(.*?)```", PAGE, re.DOTALL)
    program = domain.folder / "tasker.py"
    program.write_text(text)
    domain.serve("lesson", "--speed", SPEED)
    found = installation()
    assert found is not None
    process = Process([found.python, str(program)], domain.environment, domain.folder)
    assert process.finish() == 0, process.said
    assert process.out == shown
