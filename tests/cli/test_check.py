"""Tests of `cellwright check`."""

import json
import re
from pathlib import Path

import pytest

from tests.cell.arm_cells import ARMS, PEDESTAL
from tests.cell.checks.test_findings import OWN
from tests.cli.conftest import CommandLine


def test_map_is_drawn_beside_the_report(cellwright: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "cell.svg"
    ran = cellwright("check", "lesson", "--map", str(file))
    assert (ran.status, ran.out, ran.err) == (0, "ok\n", "")
    assert "bin8" in file.read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("lesson", "--map", "cell.pdf"), "cell.pdf: a map is a PNG or SVG file"),
        (("tandem", "--map", "cell.svg"), "--map cell.svg: only a trial has a cell; give the files of one"),
        (("lesson", "--map", "no/cell.svg"), "--map no/cell.svg: there is no folder no"),
    ],
)
def test_map_that_cannot_be_drawn_is_refused(words: tuple[str, ...], message: str, cellwright: CommandLine) -> None:
    ran = cellwright("check", *words)
    assert ran.status == 2
    assert message in ran.err


def test_check_warns_of_what_cannot_work(cellwright: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(OWN)
    ran = cellwright("check", str(file))
    assert ran.status == 0
    lines = ran.out.splitlines()
    assert lines[0] == (f"warning: {file}:5: cell.bins.far: out of reach of the arm, tool down; move it nearer")
    assert len(lines) == 4


def test_arm_and_robot_that_the_engine_refuses_are_errors_with_their_lines(
    cellwright: CommandLine, tmp_path: Path
) -> None:
    straight = re.sub("home: .*", "home: {{}}", PEDESTAL).format(model=ARMS / "ur5.urdf")
    low = "  robots: {qinglong: {model: qinglong, at: [-2.2, 0.0, 1.0]}}\n"
    (tmp_path / "own.yaml").write_text(straight.replace("  bins:", f"{low}  bins:"))
    ran = cellwright("check", "own.yaml")
    assert ran.status == 2
    lines = ran.out.splitlines()
    assert lines[0].startswith("error: own.yaml:8: cell.arms.arm.home: the arm cannot move its tool")
    assert lines[1].startswith("error: own.yaml:9: cell.robots.qinglong: Link_")


def test_check_of_missing_file_prints_error_as_json(cellwright: CommandLine) -> None:
    ran = cellwright("check", "no.yaml", "--json")
    assert ran.status == 2
    assert json.loads(ran.out) == {
        "ok": False,
        "errors": ["no.yaml: there is no such file"],
        "warnings": [],
        "resolved": None,
    }
