"""Tests of the JUnit file."""

from __future__ import annotations

from xml.etree import ElementTree

from cellwright.running.evaluation.summary import Threshold, junit
from tests.running.evaluation.results import CRASHED, LOST, result, worked


def test_junit_has_case_per_run_and_failure_per_failed_run() -> None:
    root = ElementTree.fromstring(junit([result(), worked(seed=4), CRASHED, LOST], Threshold.read("75%")))
    assert (root.tag, root.get("tests"), root.get("failures"), root.get("time")) == ("testsuites", "4", "3", "8.000")
    cases = root.findall("testsuite/testcase")
    assert [(case.get("classname"), case.get("name")) for case in cases] == [
        ("tiny", "seed 1"),
        ("tiny", "seed 4"),
        ("tiny", "seed 2"),
        ("tiny", "seed 3"),
    ]
    failures = [case.find("failure") for case in cases]
    assert failures[0] is None
    reasons = [(each.get("type"), each.get("message")) for each in failures if each is not None]
    assert reasons == [
        ("done", "2 of 12 points, below the required 75 % of the points"),
        ("crashed", "ValueError: <no> & \N{REPLACEMENT CHARACTER}"),
        ("wall_limit", "still running after 5 s"),
    ]
    assert "2 of 2  gear_part: bin1|gear_part_1 lies in its place" in (cases[1].findtext("system-out") or "")
    assert "\N{REPLACEMENT CHARACTER}[31m" in (cases[2].findtext("system-err") or "")


def test_junit_without_results_or_threshold_has_no_failures() -> None:
    assert ElementTree.fromstring(junit([], None)).get("tests") == "0"
    root = ElementTree.fromstring(junit([worked(vary=True)], None))
    assert root.get("failures") == "0"
    case = root.find("testsuite/testcase")
    assert case is not None
    assert case.get("name") == "seed 1 varied"
