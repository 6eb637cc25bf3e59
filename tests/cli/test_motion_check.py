"""The check of a motion as it is printed."""

import io
import json
import math

import pytest
from rich.console import Console

from cellwright.cli.motion_check import run_check, show
from cellwright.teleop.findings import Finding, MotionReport
from tests.teleop.robots import two_arms

GOOD = Finding("J_elbow, step 0 to 1", 6.5, 5.0, "%", "0.050 s", passed=True, note="3 of 9 samples are off")
BAD = Finding("J_wrist", math.inf, 1.0, "s late", "its effort limit is 0", passed=False, note="told in the table")


def printed(report: MotionReport) -> list[str]:
    stream = io.StringIO()
    show(Console(file=stream, width=80, highlight=False), report)
    return stream.getvalue().splitlines()


def test_a_row_for_each_finding_with_its_verdict() -> None:
    lines = printed(MotionReport("shy", "/somewhere/reference_motion.json", (GOOD, BAD)))
    assert lines[0] == "shy in its node, against its recorded motion, reference_motion.json"
    rows = [line.split() for line in lines]
    assert ["J_elbow,", "step", "0", "to", "1", "6.50", "5", "%", "0.050", "s", "ok"] in rows
    assert ["J_wrist", "-", "1", "s", "late", "its", "effort", "limit", "is", "0", "FAILS"] in rows
    assert "  J_elbow, step 0 to 1: 3 of 9 samples are off" in lines
    assert not any("told in the table" in line for line in lines)
    assert lines[-1] == "passed      1 of 2"
    assert max(map(len, lines)) <= 80


def test_the_exit_status_and_the_table_of_a_robot_without_a_recording(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_check(two_arms()) == 0
    out = capsys.readouterr().out
    assert "two_arms in its node, joint by joint: it has no recorded motion" in out
    assert "FAILS" not in out


def test_json_holds_all_findings_and_no_infinity(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    report = MotionReport("shy", "", (GOOD, BAD))
    monkeypatch.setattr("cellwright.cli.motion_check.check_motion", lambda _config, _motion: report)
    assert run_check(two_arms(), as_json=True) == 1
    read = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert (read["robot"], read["passed"], read["reference"]) == ("shy", False, None)
    assert [finding["worst"] for finding in read["findings"]] == [6.5, None]
