"""Tests of the printed motion check."""

import io
import json
import math

import pytest
from rich.console import Console

from cellwright.cli.teleop.checks import show_motion_report
from cellwright.robot.checks.rig import Finding, MotionReport
from tests.cli.conftest import CommandLine

GOOD = Finding("J_elbow, step 0 to 1", 6.5, 5.0, "%", "0.050 s", passed=True, note="3 of 9 samples are off")
BAD = Finding("J_wrist", math.inf, 1.0, "s late", "its effort limit is 0", False, "shown in the table", "raise it")


def printed(report: MotionReport) -> list[str]:
    stream = io.StringIO()
    show_motion_report(Console(file=stream, width=80, highlight=False), report)
    return stream.getvalue().splitlines()


def test_report_has_row_with_verdict_for_each_finding() -> None:
    lines = printed(MotionReport("shy", "/somewhere/reference_motion.json", (GOOD, BAD)))
    assert lines[0] == "shy in its node, compared with its recorded motion, reference_motion.json"
    rows = [line.split() for line in lines]
    assert ["J_elbow,", "step", "0", "to", "1", "6.50", "5", "%", "0.050", "s", "ok"] in rows
    assert ["J_wrist", "-", "1", "s", "late", "its", "effort", "limit", "is", "0", "FAILS"] in rows
    assert "  J_elbow, step 0 to 1: 3 of 9 samples are off" in lines
    assert not any("shown in the table" in line for line in lines)
    assert "  J_wrist: raise it" in lines
    assert lines[-1] == "passed      1 of 2"
    assert max(map(len, lines)) <= 80


@pytest.mark.slow
def test_check_of_bundled_robots_passes(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", "--check")
    assert (ran.status, ran.err) == (0, "")
    assert ran.out.startswith("tandem in its node, joint by joint, since it has no recorded motion\n")
    ran = cellwright("teleop", "qinglong", "--check", "--json")
    assert (ran.status, ran.err) == (0, "")
    assert json.loads(ran.out)["passed"] is True


@pytest.mark.slow
def test_check_with_teleport_motion_fails_with_status_1(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "qinglong", "--check", "--motion", "teleport")
    assert ran.status == 1
    assert "FAILS" in ran.out


def test_json_report_contains_no_infinity(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    report = MotionReport("shy", "", (GOOD, BAD))
    monkeypatch.setattr("cellwright.cli.teleop.checks.check_motion", lambda _node: report)
    ran = cellwright("teleop", "tandem", "--check", "--json")
    assert ran.status == 1
    read = json.loads(ran.out, parse_constant=pytest.fail)
    assert (read["robot"], read["passed"], read["reference"]) == ("shy", False, None)
    assert [finding["worst"] for finding in read["findings"]] == [6.5, None]


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["--until", "3"], "--until"),
        (["--sim-time"], "--sim-time"),
        (["--ros1"], "--ros1"),
        (["--snapshot", "x.png"], "--gui, --init-debug and --snapshot"),
        (["--video", "x.mp4"], "--video"),
        (["--view"], "--view"),
        (["--watchdog", "0.5"], "the safety options; measure a limited node with cellwright operate signal JOINT"),
    ],
)
def test_check_with_options_of_running_node_is_refused(
    arguments: list[str], name: str, cellwright: CommandLine
) -> None:
    ran = cellwright("teleop", "tandem", "--check", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert f"--check cannot be combined with {name}" in ran.err
    assert ran.err.count("\n") == 1
