"""Notices: throttled lines, limited names, and the warning of topics that contend for joints."""

from __future__ import annotations

from typing import Any

import pytest

from cellwright.middleware.messages.conversions import header, pose_message
from cellwright.middleware.messages.standard import PoseArray
from cellwright.robot.notices import MAX_LINES_PER_SECOND, MAX_NAMES, Notices
from cellwright.robot.safety import SafetySettings
from tests.robot.talk import Talk

SECOND = 1_000_000_000
JOINT = "shoulder_right"
POSES = "/io_teleop/target_ee_poses"


class Clock:
    now = 0


def make_notices() -> tuple[Notices, Clock, list[str]]:
    clock, lines = Clock(), list[str]()
    return Notices(lambda: clock.now, lines.append), clock, lines


def test_log_throttled_logs_each_kind_at_most_once_a_second() -> None:
    notices, clock, lines = make_notices()
    for tenth in range(25):
        clock.now = tenth * SECOND // 10
        notices.log_throttled("limits", f"at {tenth}")
        notices.log_throttled("other", "other")
    assert [line for line in lines if line != "other"] == ["at 0", "at 10", "at 20"]


def test_log_counts_suppressed_lines_of_a_flood() -> None:
    notices, clock, lines = make_notices()
    for _ in range(1000):
        notices.log("commands are disabled")
    assert len(lines) == MAX_LINES_PER_SECOND
    clock.now = SECOND
    notices.log("commands are enabled")
    assert lines[-1] == f"commands are enabled ({1000 - MAX_LINES_PER_SECOND} lines suppressed before)"
    notices.log("commands are disabled")
    assert lines[-1] == "commands are disabled"


def test_log_throttled_continues_after_time_restarts() -> None:
    notices, clock, lines = make_notices()
    clock.now = 100 * SECOND
    notices.log_throttled("limits", "first")
    clock.now = 0
    notices.log_throttled("limits", "second")
    assert lines == ["first", "second"]


def test_log_unknown_keeps_limited_number_of_names() -> None:
    notices, _, lines = make_notices()
    for _ in range(2):
        for number in range(1000):
            notices.log_unknown("/t", {f"{number}" * 1000: "is nothing"})
    assert len(notices.unknown) == len(lines) == MAX_NAMES
    assert all(len(name) <= 80 for name in notices.unknown)
    assert max(map(len, lines)) < 160


def test_log_unknown_skips_names_at_the_limit() -> None:
    class Unread(dict[str, str]):
        def items(self) -> Any:
            raise AssertionError("4096 names a message take their time")

    notices, _, lines = make_notices()
    notices.log_unknown("/t", {str(number): "is nothing" for number in range(MAX_NAMES)})
    notices.log_unknown("/t", Unread({"more": "is nothing"}))
    assert len(lines) == 1


def test_log_unknown_escapes_control_characters() -> None:
    notices, _, lines = make_notices()
    notices.log_unknown("/t", {"a\nb\x1b[31m": "is nothing"})
    assert lines == ["/t: 'a\\nb\\x1b[31m' is nothing; ignored (logged once)"]


def test_log_unknown_writes_many_names_in_one_line() -> None:
    notices, _, lines = make_notices()
    notices.log_unknown("/t", {"a": "is nothing"})
    notices.log_unknown("/t", dict.fromkeys("abcdefg", "is nothing"))
    assert lines[1] == "/t: 'b' is nothing, 'c' is nothing, 'd' is nothing and 3 more; ignored (logged once)"
    assert notices.unknown == list("abcdefg")
    notices.log_unknown("/t", dict.fromkeys("abcdefg", "is nothing"))
    notices.log_unknown("/t", {})
    assert len(lines) == 2


def send_both(talk: Talk, seconds: float = 1.0, pause: float = 0.01) -> None:
    """Send a joint target and the poses of the home posture in turn, as operators that publish both."""
    node = talk.node
    poses = PoseArray(header(), [pose_message(each) for each in node.ee_poses.poses()])
    for _ in range(round(seconds / pause)):
        talk.joints({JOINT: 0.9})
        node.bus.publish(POSES, poses, node="/op")
        talk.seconds(pause)


def warnings(talk: Talk) -> list[str]:
    return [line for line in talk.lines if "both command" in line]


def test_topics_in_turn_are_reported_once() -> None:
    talk = Talk()
    send_both(talk)
    (line,) = warnings(talk)
    assert line.startswith("/io_teleop/joint_cmd and /io_teleop/target_ee_poses both command ")
    assert "--command-topic joint_cmd" in line
    assert talk.at(JOINT) != pytest.approx(0.9, abs=0.05)


def test_chosen_topic_commands_alone_and_others_are_ignored_and_counted() -> None:
    talk = Talk(safety=SafetySettings(command_topics=("/io_teleop/joint_cmd",)))
    send_both(talk)
    assert talk.at(JOINT) == pytest.approx(0.9, abs=1e-3)
    assert (talk.node.commander.taken, talk.node.commander.ignored, talk.node.refused) == (100, 100, 0)
    assert warnings(talk) == []
    (line,) = [line for line in talk.lines if "ignored" in line]
    assert line.startswith("/io_teleop/target_ee_poses does not command this robot, /io_teleop/joint_cmd does")


def test_emergency_stop_needs_no_choice() -> None:
    talk = Talk(safety=SafetySettings(command_topics=("/io_teleop/joint_cmd",)))
    talk.stop()
    assert talk.node.commander.is_stopped


def test_base_and_several_topics_can_be_chosen() -> None:
    names = ("/io_teleop/joint_cmd", "/io_teleop/target_joint_from_vr")
    talk = Talk(safety=SafetySettings(command_topics=names))
    talk.joints({JOINT: 0.7})
    talk.joints({JOINT: 0.8}, "target_joint_from_vr")
    talk.joints({JOINT: 0.9}, "target_finger_joints")
    talk.base(1.0, 1.0)
    assert (talk.node.commander.taken, talk.node.commander.ignored) == (2, 2)


def test_choice_of_other_topic_is_no_contest() -> None:
    """A program ends, and another one goes on: also back again, after more than a second."""
    talk = Talk()
    for topic in ("joint_cmd", "target_joint_from_vr", "joint_cmd"):
        for _ in range(20):
            talk.joints({JOINT: 0.7}, topic)
            talk.seconds(0.06)
    assert warnings(talk) == []


def test_topics_with_joints_of_their_own_are_no_rivals() -> None:
    talk = Talk()
    for _ in range(20):
        talk.joints({JOINT: 0.7})
        talk.joints({"waist": 0.1}, "target_joint_from_vr")
        talk.seconds(0.01)
    assert warnings(talk) == []
