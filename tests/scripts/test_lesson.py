"""Tests of `make lesson` in a full installation: it works the cell over ROS 1, and leaves nothing behind."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from cellwright.cli.options import SPEED
from tests.docs.terminal import Terminal

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "lesson"
INTERRUPTED = (
    # printed by Python for a program that is interrupted while it still imports
    r'Traceback [^\n]*\n +File "[^"]*tasker\.py", line \d+, in <module>\n +import .*?\nKeyboardInterrupt\n',
    # printed by rospy if the signal that it logs comes while it logs something else
    r"--- Logging error ---\n.*?\nArguments: [^\n]*\n",
)
"""Tracebacks of programs that are not ours, by the moments of Ctrl-C."""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a folder for the packages that `cellwright ros1-env` writes once for each user."""
    return str(tmp_path_factory.mktemp("cache"))


@pytest.fixture
def user(newcomer: dict[str, str], cache: str) -> dict[str, str]:
    """Return the environment of the script."""
    return {**newcomer, "XDG_CACHE_HOME": cache}


@pytest.fixture
def root(user: dict[str, str]) -> Path:
    """Return a folder like the project's root, except that its command draws small pictures."""
    home = Path(user["HOME"])
    (home / ".venv").mkdir()
    (home / ".venv" / "bin").symlink_to(user["PATH"].partition(":")[0])
    (home / "examples").symlink_to(ROOT / "examples")
    return home


def test_lesson_script_runs_program_and_shows_score(root: Path, user: dict[str, str]) -> None:
    """The program brings one rod and no gear: tests/docs/test_lesson.py follows all of it with the page."""
    (root / "examples").unlink()
    shutil.copytree(ROOT / "examples" / "lesson", root / "examples" / "lesson")
    program = root / "examples" / "lesson" / "industrial_control" / "scripts" / "tasker.py"
    text = program.read_text(encoding="utf-8")
    assert text.count(" task.main()\n") == 1
    program.write_text(text.replace(" task.main()\n", " task.main(_fetch_from_belt=False, _num_parts=1)\n"))
    with Terminal(root, {**user, SPEED: "3"}) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 0, terminal.printed
        said = terminal.printed
    score = re.search(r"^score +(\d+) of 12 points$", said, re.MULTILINE)
    assert score is not None, said
    assert int(score[1]) >= 1  # the first rod at least, which depends on no timing
    assert re.search(r"^outcome +done$", said, re.MULTILINE), said
    assert (root / "lesson.png").read_bytes().startswith(b"\x89PNG")
    assert "Traceback" not in said


@pytest.mark.parametrize("sign", ["starting the cell", "ready:", "fetching rod 1"])
def test_ctrl_c_ends_lesson_script_and_its_processes(sign: str, root: Path, user: dict[str, str]) -> None:
    with Terminal(root, user) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: sign in terminal.printed, sign)
        terminal.interrupt()
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 130, terminal.printed
        said = terminal.printed.replace("\r", "")
    for pattern in INTERRUPTED:
        said = re.sub(pattern, "", said, flags=re.DOTALL)
    assert "Traceback" not in said
    assert not (root / "lesson.png").exists()  # drawing it would take too long


def test_lesson_script_without_ros_names_remedy(root: Path, user: dict[str, str]) -> None:
    nowhere = {**user, "CELLWRIGHT_ROS1_PYTHON": "/nowhere/python3"}
    with Terminal(root, nowhere) as terminal:
        terminal.give(shlex.quote(str(SCRIPT)))
        terminal.wait(lambda: terminal.status is not None, "end of the lesson")
        assert terminal.status == 2, terminal.printed
        assert "install" in terminal.printed
        assert "starting the cell" not in terminal.printed
