"""The lesson can be followed from its first line to its last, on a real ROS 1: as two pages, and as a notebook."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cellwright.cli.options import SPEED
from cellwright.clients.agents.lesson import WAYPOINTS
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial, resolved
from tests.docs import notebook
from tests.docs.pages import Command, File, missing, pieces, steps
from tests.docs.session import follow
from tests.ros1.first_step import FirstStep
from tests.support.waiting import TIMEOUT

pytest_plugins = ["tests.ros1.fixtures"]

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "docs" / "lesson.md", ROOT / "docs" / "lesson-program.md")
NOTEBOOK = ROOT / "docs" / "lesson.ipynb"
PACKAGE = ROOT / "examples" / "lesson" / "industrial_control"
FASTER = "2"
"""Real-time factor of the cells: the program of the page waits by the clock of its cell.

More would cost more than it saves: the tools of ROS take their time by the wall, and the cells work meanwhile.
"""

RUN_NOTEBOOK = """
import sys
import nbclient, nbformat
book = nbformat.read(sys.argv[1], as_version=4)
limit = int(sys.argv[2])
# nbclient's own command waits 4 s for the output of a cell, and then drops it without a word.
nbclient.NotebookClient(book, timeout=limit, iopub_timeout=limit, raise_on_iopub_timeout=True).execute()
nbformat.write(book, sys.argv[1])
"""

WRITE = "CELLWRIGHT_WRITE_NOTEBOOK"
"""With this variable set, the notebook is written again, with its outputs."""


GEARS = ("belt_population_cycles: 20", "belt_population_cycles: 5")
"""The page's belt, and one that soon is empty: a program that misses one gear by its timing misses all of them."""

PATIENCE = 'rospy.get_param("~patience", 20.0)'
"""Bound of the wait for a gear in the page's program [s]; a gear comes every six seconds, looked for once a second."""


@pytest.mark.ros1
def test_lesson_followed_as_pages_and_notebook_prints_what_it_shows(
    newcomer: dict[str, str], first_step: FirstStep
) -> None:
    """One after the other in one home, so that the workspace is built once; the notebook writes its own package."""
    home, environment = first_step.home, {**newcomer, SPEED: FASTER, "HOME": str(first_step.home)}
    package, header = (
        first_step.workspace / path for path in ("src/industrial_control", "devel/include/osrf_gear/Order.h")
    )
    built = header.stat().st_mtime_ns
    page = hurried(text_of_pages(), timeout=7.0)
    first, *others = [step for piece in pieces(page) if not isinstance(piece, str) for step in piece]
    assert isinstance(first, Command)
    assert first.line == "cellwright ros1-workspace ~/simulation_ws"
    assert missing(first.output, first_step.printed) is None, first_step.printed
    try:
        follow(others, home, environment)
        shutil.rmtree(package)
        printed = run_notebook(home, environment)
    finally:
        shutil.rmtree(package, ignore_errors=True)
    assert "built in " in printed, "the notebook builds the workspace a second time"
    assert header.stat().st_mtime_ns == built, "and then makes nothing again"
    assert not list((first_step.workspace / "src").rglob("*~"))


def text_of_pages() -> str:
    """Both pages as one: terminals and files of the first go on in the second."""
    return "\n".join(page.read_text(encoding="utf-8") for page in PAGES)


def hurried(page: str, *, timeout: float) -> str:
    """Return the text of the pages with few gears on the belt.

    Args:
        page: its text.
        timeout: bound of the wait for a gear in its program [s].
    """
    assert GEARS[0] in page
    assert PATIENCE in page
    return page.replace(*GEARS).replace(PATIENCE, PATIENCE.replace("20.0", str(timeout)))


def run_notebook(home: Path, environment: dict[str, str]) -> str:
    """Run the notebook as Jupyter does, and compare what its cells print with what the page shows.

    Unless it is to be written, its program hardly waits for gears: with the page it has the time for one at least.

    Returns:
        All that was printed.
    """
    page = text_of_pages()
    if WRITE not in os.environ:
        page = hurried(page, timeout=1.0)
    made = notebook.cells(page)
    file = home / NOTEBOOK.name
    file.write_text(notebook.as_text(notebook.document(made)), encoding="utf-8")
    command = [sys.executable, "-c", RUN_NOTEBOOK, file.name, f"{TIMEOUT:g}"]
    ran = subprocess.run(command, cwd=home, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr[-6000:]
    outputs = {
        number: notebook.printed(cell["outputs"])
        for number, cell in enumerate(json.loads(file.read_text(encoding="utf-8"))["cells"])
        if cell.get("outputs")
    }
    check(made, outputs, ran.stderr)
    if WRITE in os.environ:
        logs = str(Path(environment["ROS_HOME"]).parent)
        names = {str(home): "/home/you", logs: "/tmp", str(ROOT): "/home/you/cellwright"}
        shown = {number: notebook.as_output(text, names) for number, text in outputs.items()}
        NOTEBOOK.write_text(notebook.as_text(notebook.document(made, shown)), encoding="utf-8")
    return "".join(outputs.values())


def check(made: list[notebook.Cell], outputs: dict[int, str], more: str = "") -> None:
    """Compare what cells printed with what the page shows."""
    for number, cell in enumerate(made):
        text = outputs.get(number, "")
        assert missing(cell.shown, text) is None, f"{cell.source}\n{text}\n{outputs}\n{more}"


def test_notebook_equals_pages() -> None:
    made = notebook.cells(text_of_pages())
    stored = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    outputs: dict[int, Any] = {n: cell["outputs"] for n, cell in enumerate(stored["cells"]) if cell.get("outputs")}
    assert stored == notebook.document(made, outputs), f"write it again: {WRITE}=1 pytest {Path(__file__).name}"
    check(made, {number: notebook.printed(each) for number, each in outputs.items()})


def test_files_of_pages_equal_example_package() -> None:
    written: dict[str, list[str]] = {}
    for step in (step for page in PAGES for step in steps(page)):
        if isinstance(step, File):
            written.setdefault(step.name.removeprefix("simulation_ws/src/industrial_control/"), []).append(step.text)
    files = {str(path.relative_to(PACKAGE)): path.read_text() for path in PACKAGE.rglob("*") if path.is_file()}
    first = files.pop("config/first_config.yaml")
    assert written.pop("config/my_config.yaml") == [first, files.pop("config/my_config.yaml")]
    assert written == {name: [text] for name, text in files.items()}
    assert os.access(PACKAGE / "scripts" / "tasker.py", os.X_OK)


def test_example_package_equals_bundled_trial_and_agent() -> None:
    mine, bundled = (load_trial([path]) for path in (PACKAGE / "config" / "my_config.yaml", find_trial("lesson")))
    assert resolved(mine) == resolved(bundled)
    assert mine.trial.sensors == bundled.trial.sensors
    program = ast.parse((PACKAGE / "scripts" / "tasker.py").read_text())
    lists = [
        ast.literal_eval(node.value)
        for node in ast.walk(program)
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "self.waypoints"
    ]
    assert [tuple(map(tuple, each)) for each in lists] == [WAYPOINTS]
