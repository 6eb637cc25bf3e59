"""Tests of `cellwright eval --agents`: a class in one command."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine
from tests.running.evaluation.made_results import result
from tests.running.evaluation.programs import TRIAL
from tests.support.quick_children import QUICK_AGENTS, QUICK_WORKERS

CLASS = {
    "good": """
class Mine:
    def run(self, client):
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")
""",
    "waiting": """
class Mine:
    def run(self, client):
        while True:
            client.sleep(0.5)
""",
    "crashing": """
class Mine:
    def run(self, client):
        client.start_competition()
        raise RuntimeError("=no part in the camera")
""",
    "endless": """
import time

class Mine:
    def run(self, client):
        client.start_competition()
        while True:
            time.sleep(0.01)
""",
    "cheating": """
import os
import signal
from pathlib import Path

class Mine:
    def run(self, client):
        from cellwright.cell.kitting.kit_score import KitScore

        KitScore.total = property(lambda score: 99.0)
        file = Path("class", "results.jsonl")
        file.write_bytes(file.read_bytes().replace(b'"points":0.0', b'"points":6.0'))
        client.start_competition()
        os.kill(os.getppid(), signal.SIGTERM)
        client.sleep(30.0)
""",
    "broken": "import numpi\n",
}


@pytest.fixture
def lessons(cellwright: CommandLine) -> CommandLine:
    """Return the command line in a folder with a trial and a class."""
    Path("tiny.yaml").write_text(TRIAL)
    Path("other.yaml").write_text(f"{TRIAL}\ntime_limit: 60\n")
    Path("students").mkdir()
    for name, text in CLASS.items():
        Path("students", f"{name}.py").write_text(text)
    return cellwright


def sheet() -> dict[str, dict[str, str]]:
    """Return the rows of the sheet by name."""
    with Path("class", "class.csv").open(encoding="utf-8") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


@QUICK_WORKERS
@QUICK_AGENTS
@pytest.mark.slow
def test_class_of_good_and_bad_programs_has_one_sheet_and_no_program_spoils_another(lessons: CommandLine) -> None:
    Path("students", "copy.py").write_text(f"# mine\n{CLASS['good']}")
    work = ("eval", "tiny.yaml", "other.yaml", "--agents", "students/*.py:Mine", "--out", "class")
    ran = lessons(*work, "--time-limit", "6", "--start-limit", "2", "--json")
    assert ran.status == 0, ran.err
    rows = sheet()
    assert list(rows) == ["broken", "cheating", "copy", "crashing", "endless", "good", "waiting"]
    for name in ("good", "copy"):
        assert (rows[name]["share, %"], rows[name]["passed"], rows[name]["runs"]) == ("100.0", "2", "2")
        assert rows[name]["endings"] == "2 done"
    for name in ("broken", "cheating", "crashing", "endless", "waiting"):
        assert (rows[name]["share, %"], rows[name]["passed"], rows[name]["runs"]) == ("0.0", "0", "2"), name
    assert "refused" in rows["broken"]["endings"]
    assert "numpi" in rows["broken"]["reason"]
    assert "wall limit" in rows["endless"]["endings"]
    assert "start limit" in rows["waiting"]["endings"]
    assert "2 s of simulation time" in rows["waiting"]["reason"]
    assert rows["good"]["same end states as"].startswith("copy (")
    assert rows["crashing"]["same end states as"] == ""
    feedback = {file.stem: file.read_text(encoding="utf-8") for file in Path("class", "feedback").iterdir()}
    assert set(feedback) == set(rows)
    assert "numpi" in feedback["broken"]
    assert "=no part in the camera" in feedback["crashing"]
    assert "students/good.py" not in feedback["copy"]
    page = Path("class", "class.html").read_text(encoding="utf-8")
    assert all(f'href="feedback/{name}.html"' in page for name in rows)
    document = json.loads(ran.out)
    assert [row["name"] for row in document["agents"]] == list(rows)
    again = lessons(*work, "--time-limit", "6", "--start-limit", "2")
    assert (again.status, sheet()) == (0, rows)
    assert "14 of them have a result already" in again.out


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("--agents", "pupils/*.py:Mine"), "--agents pupils/*.py:Mine: there is no such Python file"),
        (("--agents", "students/*.py"), "--agents students/*.py: names no class"),
        (("--agents", "students/*.py:Mine", "--agent", "lesson"), "--agent: does not go with --agents"),
        (("--agents", "students/*.py:Mine", "--shard", "1/2"), "--shard: does not go with --agents"),
    ],
)
def test_unusable_class_is_refused(lessons: CommandLine, arguments: tuple[str, ...], error: str) -> None:
    ran = lessons("eval", "tiny.yaml", *arguments)
    assert (ran.status, Path("evaluation").exists()) == (2, False)
    assert ran.err.startswith(f"error: {error}")


@QUICK_WORKERS
@QUICK_AGENTS
@pytest.mark.slow
def test_class_without_a_program_that_can_be_made_is_bad_input_with_a_sheet(lessons: CommandLine) -> None:
    Path("students", "none.py").write_text("class Yours: pass\n")
    names = ("broken", "none")
    work = ("eval", "tiny.yaml", "--out", "class", *(f"--agents=students/{name}.py:Mine" for name in names))
    ran = lessons(*work, "--seeds", "2", "--json")
    assert (ran.status, json.loads(ran.out)["exit_status"]) == (2, 2)
    assert [sheet()[name]["reason"] != "" for name in names] == [True, True]
    assert "error: --agents: no program could be made, as students/broken.py:Mine: " in ran.err
    assert "numpi" in ran.err
    assert lessons(*work, "--seeds", "2").status == 2
    assert lessons(*work, "--agents", "students/crashing.py:Mine").status == 0


def test_class_does_not_replace_the_report_of_one_program(lessons: CommandLine) -> None:
    folder = Path("before")
    folder.mkdir()
    files = {"plan.json": b"{}\n", "results.jsonl": result().line + b"\n", "summary.json": b"{}\n"}
    for name, content in files.items():
        (folder / name).write_bytes(content)
    ran = lessons("eval", "tiny.yaml", "--agents", "students/good.py:Mine", "--out", "before")
    assert ran.status == 2
    assert "error: --out before: holds the evaluation of one program; give another folder" in ran.err
    assert {each.name: each.read_bytes() for each in folder.iterdir() if each.is_file()} == files


@QUICK_WORKERS
@QUICK_AGENTS
@pytest.mark.slow
def test_program_that_changes_while_the_class_runs_is_named(lessons: CommandLine) -> None:
    for name in CLASS:
        Path("students", f"{name}.py").unlink()
    Path("students", "good.py").write_text(CLASS["good"])
    spoil = f"{CLASS['good']}        open('students/good.py', 'a').write('#')\n"
    Path("students", "spoiling.py").write_text(spoil)
    ran = lessons("eval", "tiny.yaml", "--agents", "students/*.py:Mine", "--out", "class")
    assert ran.status == 75
    assert "error: students/good.py:Mine: its files changed while the class ran" in ran.err
    assert "spoiling" not in ran.err
