"""`make lesson`, from where all is installed: it works the cell over ROS 1, and leaves nothing behind."""

import re
import shlex
import time
from pathlib import Path

import pytest

from tests.docs.terminal import Terminal

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "lesson"
IMPORTING = re.compile(
    r'Traceback [^\n]*\n +File "[^"]*tasker\.py", line \d+, in <module>\n +import .*?\nKeyboardInterrupt\n', re.DOTALL
)
"""What Python says of a program that is ended while it still imports: nobody could say it better."""

LIMIT = 400.0
"""For the whole of it [s]: it takes a minute and a quarter on a machine that does nothing else."""


def test_it_plays_the_lesson_and_shows_what_came_of_it(newcomer: dict[str, str]) -> None:
    picture = Path(newcomer["HOME"]) / "lesson.png"
    with Terminal(ROOT, newcomer) as terminal:
        terminal.give(f"{SCRIPT} {shlex.quote(str(picture))}")
        assert terminal.wait(lambda: terminal.status is not None, LIMIT), terminal.printed
        assert terminal.status == 0, terminal.printed
        said = terminal.printed
    score = re.search(r"^score +(\d+) of 12 points$", said, re.MULTILINE)
    assert score is not None, said
    assert int(score[1]) >= 1  # the first rod at least: nothing about it is a matter of timing
    assert re.search(r"^outcome +done$", said, re.MULTILINE), said
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "Traceback" not in said


@pytest.mark.parametrize("sign", ["starting the cell", "ready:", "fetching rod 1"])
def test_ctrl_c_ends_it_in_order(sign: str, newcomer: dict[str, str]) -> None:
    with Terminal(ROOT, newcomer) as terminal:
        terminal.give(f"{SCRIPT} {shlex.quote(newcomer['HOME'])}/lesson.png")
        assert terminal.wait(lambda: sign in terminal.printed, LIMIT), terminal.printed
        time.sleep(0.3)  # rospy logs that it was interrupted, and complains if it is just then logging something else
        terminal.interrupt()
        assert terminal.wait(lambda: terminal.status is not None, 30.0), terminal.printed
        assert terminal.status == 130, terminal.printed
        assert "Traceback" not in IMPORTING.sub("", terminal.printed.replace("\r", ""))
    assert not Path(newcomer["HOME"], "lesson.png").exists()  # drawing it takes longer than one likes to wait


def test_without_ros_it_says_so(newcomer: dict[str, str]) -> None:
    nowhere = {**newcomer, "CELLWRIGHT_ROS1_PYTHON": "/nowhere/python3"}
    with Terminal(ROOT, nowhere) as terminal:
        terminal.give(str(SCRIPT))
        assert terminal.wait(lambda: terminal.status is not None, LIMIT), terminal.printed
        assert terminal.status == 2, terminal.printed
        assert "install" in terminal.printed
        assert "starting the cell" not in terminal.printed
