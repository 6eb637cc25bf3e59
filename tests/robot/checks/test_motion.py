"""Motion check: the QingLong passes it, and robots with other motion fail."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import GripperConfig, RobotConfig
from cellwright.config.robot.model import Limits, Mimic
from cellwright.config.robot.robots import load_robot
from cellwright.robot.checks import motion as check_joints
from cellwright.robot.checks import reference as check_reference
from cellwright.robot.checks.motion import check_motion
from cellwright.robot.checks.reference import REFERENCE_FILE
from cellwright.robot.checks.rig import Finding, MotionReport
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.servos import Motion
from cellwright.util.errors import UsageError
from tests.robot.robots import two_arms

EMPTY = '{"steps_per_second": 240, "joints": [], "hands": [], "grippers": [], "closing": [], "steps": [], "sines": []}'


@pytest.fixture(scope="module")
def qinglong() -> RobotConfig:
    return load_robot("qinglong", warn=pytest.fail)


@pytest.fixture(scope="module")
def report(qinglong: RobotConfig) -> MotionReport:
    return check(qinglong)


def check(config: RobotConfig, motion: Motion = Motion.SERVO) -> MotionReport:
    return check_motion(RobotNode(config, RobotSettings(motion)))


@pytest.mark.slow
def test_qinglong_moves_as_recorded(report: MotionReport) -> None:
    assert report.passed, [finding for finding in report.findings if not finding.passed]
    assert report.reference.endswith(REFERENCE_FILE)


def test_every_recorded_item_is_checked(report: MotionReport, qinglong: RobotConfig) -> None:
    recorded = json.loads((qinglong.path.parent / REFERENCE_FILE).read_text("utf-8"))
    assert len(recorded["joints"]) == 75
    names = [finding.what for finding in report.findings]
    assert sum("step" in name for name in names) == len(recorded["steps"]) == 8
    assert sum("sine" in name for name in names) == len(recorded["sines"]) == 1
    assert sum("at home" in name for name in names) == 2 * len(recorded["hands"]) == 4
    assert sum("gripper" in name for name in names) == len(recorded["grippers"]) + len(recorded["closing"]) == 3


def test_check_limits_equal_published_ones(report: MotionReport) -> None:
    limits = {(finding.unit, finding.limit) for finding in report.findings}
    assert limits == {("differ", 0), ("mm", 1.0), ("mrad", 1.0), ("%", 5.0), ("%", 3.0)}
    assert check_reference.MAX_TIME_ERROR == 0.02


def test_samples_within_time_error_only_get_a_note(report: MotionReport) -> None:
    for finding in report.findings:
        assert bool(finding.note) == (finding.unit == "%" and finding.worst > finding.limit)


@pytest.mark.slow
def test_teleported_motion_fails_every_response(qinglong: RobotConfig) -> None:
    """Teleported joints end where they should, and fail every response on the way."""
    findings = check(qinglong, motion=Motion.TELEPORT).findings
    assert {finding.unit == "%" for finding in findings if not finding.passed} == {True}
    assert all(not finding.passed for finding in findings if finding.unit == "%")


@pytest.mark.slow
def test_slower_joint_fails_only_its_own_steps(qinglong: RobotConfig) -> None:
    robot = qinglong.robot
    slow = tuple(
        replace(joint, limits=replace(joint.limits, velocity=0.8 * joint.limits.velocity))
        if joint.name == "J_arm_r_04"
        else joint
        for joint in robot.joints
    )
    findings = check(replace(qinglong, robot=replace(robot, joints=slow))).findings
    assert {finding.what.split(",")[0] for finding in findings if not finding.passed} == {"J_arm_r_04"}


Change = Callable[[dict[str, Any]], object]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "title", "where"),
    [
        (lambda read: read["joints"].reverse(), "order of 75 joint states", "0: J_head_yaw instead of J_ankle_l_roll"),
        (lambda read: read["joints"].pop(), "order of 74 joint states", "74: J_ankle_l_roll instead of nothing"),
        (lambda read: read["hands"][0]["position"].__setitem__(0, 0.2155), "io_teleop_ee_link_right at home", ""),
        (lambda read: read["hands"][0]["orientation"].__setitem__(0, -0.7), "io_teleop_ee_link_right at home", ""),
        (lambda read: read["hands"][0].update(link="hook"), "hook at home", "the robot has no such link"),
        (lambda read: read["steps"][0].update(joint="J_tail"), "J_tail, step 0 to 0.5", "the robot has no such joint"),
        (lambda read: read["steps"][0]["samples"][8].__setitem__(1, 0.4), "J_head_yaw, step 0 to 0.5", "0.037 s"),
        (lambda read: read["grippers"][0]["joints"].reverse(), "right gripper, joints", "the gripper has other joints"),
        (lambda read: read["grippers"][0]["positions"][0]["joints"].__setitem__(2, 0.4), "right gripper", "rh_THJ2"),
    ],
)
def test_single_deviation_gives_exactly_one_failed_finding(
    tmp_path: Path, qinglong: RobotConfig, change: Change, title: str, where: str
) -> None:
    """In a short recording, so that a case costs little."""
    read = json.loads((qinglong.path.parent / REFERENCE_FILE).read_text("utf-8"))
    read.update(hands=read["hands"][:1], grippers=read["grippers"][:1], closing=[], sines=[])
    read["steps"] = [{"joint": "J_head_yaw", "start": 0.0, "target": 0.5, "samples": read["steps"][3]["samples"][:16]}]
    read["grippers"][0]["positions"] = read["grippers"][0]["positions"][2:3]
    change(read)
    (tmp_path / REFERENCE_FILE).write_text(json.dumps(read), "utf-8")
    bad = [
        finding for finding in check(replace(qinglong, path=tmp_path / "vr_configs.yml")).findings if not finding.passed
    ]
    assert len(bad) == 1
    assert bad[0].what.startswith(title)
    assert where in bad[0].where


@settings(max_examples=40, deadline=None)
@given(late=st.floats(-0.03, 0.03))
def test_response_shifted_by_20_ms_passes(late: float) -> None:
    """A ramp of 1 rad in 0.5 s, sampled here and there."""
    times = np.linspace(0.0, 2.0, 481)
    at = np.linspace(0.25, 0.6, 8)

    def ramp(time: Any) -> Any:
        return np.clip((time - 0.2) / 0.5, 0.0, 1.0)

    finding = check_reference._response("ramp", times, ramp(times), at, ramp(at - late), 1.0)
    assert finding.worst == pytest.approx(100 * abs(late) / 0.5, abs=0.5)
    if not math.isclose(abs(late), 0.0205, abs_tol=0.0015):
        assert finding.passed == (abs(late) < 0.0205 or abs(late) / 0.5 < 0.05)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "\x00",
        EMPTY.replace("240", '"fast"'),
        EMPTY.replace('"joints": []', '"joints": 7'),
        EMPTY.replace('"hands": []', '"hands": [{"link": "tip", "position": [0, 0], "orientation": [0, 0, 0, 1]}]'),
        EMPTY.replace(
            '"hands": []', '"hands": [{"link": "tip", "position": [0, 0, NaN], "orientation": [0, 0, 0, 1]}]'
        ),
        EMPTY.replace('"steps": []', '"steps": [{"joint": "waist", "start": 0, "target": 1, "samples": []}]'),
        EMPTY.replace('"steps": []', '"steps": [{"joint": "waist", "start": 0, "target": 1, "samples": [[1, 1e999]]}]'),
    ],
)
def test_invalid_reference_file_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / REFERENCE_FILE
    path.write_text(text, "utf-8")
    with pytest.raises(UsageError, match=r"reference_motion\.json: not a recorded motion"):
        check(replace(two_arms(), path=tmp_path / "vr_configs.yml"))


def test_empty_reference_checks_only_joint_order(tmp_path: Path) -> None:
    (tmp_path / REFERENCE_FILE).write_text(EMPTY, "utf-8")
    report = check(replace(two_arms(), path=tmp_path / "vr_configs.yml"))
    assert [finding.what for finding in report.findings] == ["order of 0 joint states"]


def test_reference_without_motion_requires_joint_at_rest(tmp_path: Path) -> None:
    step = '{"joint": "waist", "start": 0, "target": %s, "samples": [[1, 0.0], [100, 0.0]]}'
    verdicts = []
    for target in ("0", "0.5"):
        (tmp_path / REFERENCE_FILE).write_text(EMPTY.replace('"steps": []', f'"steps": [{step % target}]'), "utf-8")
        verdicts.append(check(replace(two_arms(), path=tmp_path / "vr_configs.yml")).findings[-1].passed)
    assert verdicts == [True, False]


def with_limits(joint: str, **values: float) -> RobotConfig:
    config = two_arms()
    joints = tuple(
        replace(each, limits=replace(each.limits, **values)) if each.name == joint else each
        for each in config.robot.joints
    )
    return replace(config, robot=replace(config.robot, joints=joints))


def test_robot_without_reference_is_checked_joint_by_joint() -> None:
    report = check(two_arms())
    assert (report.passed, report.reference) == (True, "")
    driven = [joint for joint in two_arms().robot.driven if joint.mimic is None]
    assert f"settling time of {len(driven)} joints" in [finding.what for finding in report.findings]
    assert sum("gripper closes" in finding.what for finding in report.findings) == 2
    assert report.findings[-1].what == "homing time"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "why"),
    [
        ({"effort": 0.0}, "its effort limit is 0"),
        ({"velocity": 0.0}, "its velocity limit is 0"),
        ({"effort": 1e-4}, "it does not settle within 2 % of the step"),
        ({"lower": 0.0, "upper": 0.0}, "its limits leave no range: 0 to 0"),
    ],
)
def test_immovable_joint_fails_with_reason(limits: dict[str, float], why: str) -> None:
    found = [f for f in check(with_limits("elbow_left", **limits)).findings if f.what == "elbow_left"]
    assert [(finding.passed, finding.where) for finding in found] == [(False, why)]


def test_robot_without_joints_passes() -> None:
    config = two_arms()
    still = replace(config.robot, joints=(), links={"base": config.robot.links["base"]})
    report = check(RobotConfig(still, "stone", Path("stone.urdf"), Path("stone.urdf")))
    assert [finding.what for finding in report.findings] == ["order of 0 joint states"]
    assert report.passed


def test_findings_are_passed_to_callback_in_order() -> None:
    reported: list[Finding] = []
    report = check_motion(RobotNode(with_limits("wheel", upper=math.inf)), reported.append)
    assert tuple(reported) == report.findings
    assert Limits() == two_arms().robot.joint("wheel").limits  # a joint without limits is moved as well


def test_joint_too_weak_to_brake_fails_overshoot() -> None:
    findings = check(with_limits("shoulder_left", effort=9.0)).findings
    assert [(f.what, f.where) for f in findings if not f.passed and f.unit == "% of step"] == [
        ("largest overshoot", "shoulder_left")
    ]


def test_unsettled_joint_counts_for_largest_overshoot() -> None:
    """With an effort of 2 N m the shoulder swings about its target for seconds."""
    findings = {finding.what: finding for finding in check(with_limits("shoulder_left", effort=2.0)).findings}
    assert findings["shoulder_left"].where == "it does not settle within 2 % of the step"
    farthest = findings["largest overshoot"]
    assert (farthest.where, farthest.passed) == ("shoulder_left", False)
    assert farthest.worst > 100 * check_joints.OVERSHOOT
    assert farthest.remedy.startswith("drives reach their effort limits; add to the configuration: arms[1].")


def test_pushed_joint_fails_with_name_of_pushing_joint() -> None:
    findings = {finding.what: finding for finding in check(with_limits("elbow_left", effort=3.0)).findings}
    strays = findings["largest motion of other joints"]
    assert (strays.where, strays.passed) == ("elbow_left, while shoulder_left moves", False)
    assert strays.worst > 1e3 * check_joints.STRAY
    remedies = [finding.remedy for finding in findings.values() if finding.remedy]
    assert len(remedies) == 1
    assert "arms[1].max_acceleration: [" in remedies[0]


def test_joint_with_acceleration_limit_gets_longer_settling_time() -> None:
    config = replace(two_arms(), max_accelerations={"waist": 0.3})  # 0.2 rad take 1.6 s
    findings = {finding.what: finding for finding in check(config).findings}
    settles = next(finding for title, finding in findings.items() if title.startswith("settling time"))
    assert settles.passed
    assert "waist" not in findings


def test_home_beyond_limits_fails_initial_posture() -> None:
    config = two_arms()
    right = replace(config.arms[0], home=(2.4, -1.0, 0.2))
    holds = check(replace(config, arms=(right, config.arms[1]))).findings[1]
    assert (holds.what, holds.where, holds.passed) == ("holds the initial posture", "shoulder_right", False)


def test_mimic_finger_closing_to_lower_limit_passes() -> None:
    config = two_arms()
    thumb = config.robot.joint("thumb_left")
    other_way = replace(thumb, limits=replace(thumb.limits, lower=-0.04, upper=0.0), mimic=Mimic("finger_left", -1.0))
    joints = tuple(other_way if joint == thumb else joint for joint in config.robot.joints)
    grippers = (config.grippers[0], GripperConfig(("finger_left", "thumb_left")))
    changed = replace(config, robot=replace(config.robot, joints=joints), grippers=grippers)
    closes = [finding for finding in check(changed).findings if finding.what == "left gripper closes"]
    assert [(each.where, each.passed) for each in closes] == [("finger_left", True)]
