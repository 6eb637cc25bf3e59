"""Tests of the JUnit file."""

from __future__ import annotations

from xml.etree import ElementTree

from cellwright.running.evaluation.outputs.junit import junit
from cellwright.running.evaluation.results.summary import Threshold
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked


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


def test_junit_properties_have_figures_with_intervals() -> None:
    results = [result(6.0 + seed % 3, seed=seed) for seed in range(12)]
    root = ElementTree.fromstring(junit(results, Threshold.read("7")))
    assert root.find("testsuite/*[1]") is root.find("testsuite/properties")  # its place in the schema
    found = {each.get("name"): each.get("value") for each in root.iter("property")}
    assert found["passed"] == found["tiny: passed"] == "8 of 12"
    assert found["passed, 95 % interval"] == "39.1 to 86.2 %"
    assert found["share"] == "58.3%"
    assert found["tiny: mean"] == "7"
    assert (found["tiny: time, s"], found["tiny: time, s, spread"]) == ("20", "0")
    assert found["tiny: mean, 95 % interval"] == "6.45 to 7.53"


def test_junit_without_results_or_threshold_has_no_failures() -> None:
    assert ElementTree.fromstring(junit([], None)).get("tests") == "0"
    root = ElementTree.fromstring(junit([worked(vary=True)], None))
    assert root.get("failures") == "0"
    case = root.find("testsuite/testcase")
    assert case is not None
    assert case.get("name") == "seed 1 varied"
