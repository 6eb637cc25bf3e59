"""`make lesson`, from where all is installed: it works the cell over ROS 1, and leaves nothing behind."""

import re
import shlex
from pathlib import Path

import pytest

from cellwright.cli.options import SPEED
from tests.docs.terminal import Terminal

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "lesson"
INTERRUPTED = (
    # Python's words about a program that is interrupted while it still imports
    r'Traceback [^\n]*\n +File "[^"]*tasker\.py", line \d+, in <module>\n +import .*?\nKeyboardInterrupt\n',
    # rospy's, where the signal that it logs comes while it logs something else
    r"--- Logging error ---\n.*?\nArguments: [^\n]*\n",
)
"""Tracebacks of programs that are not ours, by moments at which Ctrl-C may come."""


@pytest.fixture
def root(newcomer: dict[str, str]) -> Path:
    """A folder like the project's root, but that its command draws small pictures."""
    home = Path(newcomer["HOME"])
    (home / ".venv").mkdir()
    (home / ".venv" / "bin").symlink_to(newcomer["PATH"].partition(":")[0])
    (home / "examples").symlink_to(ROOT / "examples")
    return home


def test_it_plays_the_lesson_and_shows_what_came_of_it(root: Path, newcomer: dict[str, str]) -> None:
    with Terminal(root, {**newcomer, SPEED: "3"}) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 0, terminal.printed
        said = terminal.printed
    score = re.search(r"^score +(\d+) of 12 points$", said, re.MULTILINE)
    assert score is not None, said
    assert int(score[1]) >= 1  # the first rod at least: nothing about it is a matter of timing
    assert re.search(r"^outcome +done$", said, re.MULTILINE), said
    assert (root / "lesson.png").read_bytes().startswith(b"\x89PNG")
    assert "Traceback" not in said


@pytest.mark.parametrize("sign", ["starting the cell", "ready:", "fetching rod 1"])
def test_ctrl_c_ends_it_in_order(sign: str, root: Path, newcomer: dict[str, str]) -> None:
    with Terminal(root, newcomer) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: sign in terminal.printed, sign)
        terminal.interrupt()
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 130, terminal.printed
        said = terminal.printed.replace("\r", "")
    for pattern in INTERRUPTED:
        said = re.sub(pattern, "", said, flags=re.DOTALL)
    assert "Traceback" not in said
    assert not (root / "lesson.png").exists()  # drawing it takes longer than one likes to wait


def test_without_ros_it_says_so(root: Path, newcomer: dict[str, str]) -> None:
    nowhere = {**newcomer, "CELLWRIGHT_ROS1_PYTHON": "/nowhere/python3"}
    with Terminal(root, nowhere) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 2, terminal.printed
        assert "install" in terminal.printed
        assert "starting the cell" not in terminal.printed
