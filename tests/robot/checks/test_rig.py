"""Test rig of motion checks: its steps, and the report of its findings."""

import pytest

from cellwright.robot.checks.rig import Finding, MotionReport, Rig
from cellwright.robot.node import RobotNode
from tests.robot.robots import two_arms


def test_run_returns_positions_from_before_first_step() -> None:
    rig = Rig(RobotNode(two_arms()))
    rig.begin()
    before = rig.positions
    rig.send({"waist": 0.3})
    times, positions = rig.run(0.5)
    assert times.tolist() == pytest.approx([number / 240 for number in range(121)])
    assert positions.shape == (121, len(before))
    assert positions[0].tolist() == before.tolist()
    assert positions[-1][rig.numbers["waist"]] == pytest.approx(0.3, abs=0.01)
    assert "waist" in rig.joint_states


def test_reset_returns_its_duration_or_why_it_failed() -> None:
    rig = Rig(RobotNode(two_arms()))
    rig.begin()
    rig.send({"waist": 0.3})
    rig.run(0.2)
    seconds, failure = rig.reset()
    assert (seconds > 0.0, failure) == (True, "")
    rig.node.commander.stop("pressed")
    seconds, failure = rig.reset()
    assert seconds == 0.0
    assert "emergency stop is active" in failure


def test_report_passes_with_passed_findings_only() -> None:
    good = Finding("error", 0.1, 0.2, "rad")
    bad = Finding("error", 0.3, 0.2, "rad", passed=False)
    assert MotionReport("tandem", "", (good,)).passed
    assert not MotionReport("tandem", "", (good, bad)).passed
