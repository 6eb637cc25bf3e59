"""Two topics that command the same joints: a warning, and the choice of one."""

from __future__ import annotations

import pytest

from cellwright.middleware.messages.conversions import header, pose_message
from cellwright.middleware.messages.standard import PoseArray
from cellwright.robot.safety import SafetySettings
from tests.robot.talk import Talk

JOINT = "shoulder_right"
POSES = "/io_teleop/target_ee_poses"


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
