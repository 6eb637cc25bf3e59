"""Commander and watchdog: mostly requests of teleoperation users in other projects' issue trackers, each as a test."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cellwright.middleware.messages.standard import PoseArray
from cellwright.robot.commander import CLEAR_STOP, ENABLE
from cellwright.robot.safety import Guard, SafetySettings
from cellwright.util.errors import RejectedCommandError
from tests.robot.talk import Talk, stamped


def test_disabled_arm_ignores_alternating_commands() -> None:
    talk = Talk(safety=SafetySettings(start_disabled=True))
    for number in range(100):
        talk.joints({"shoulder_right": math.sin(number)}, node="/a")
        talk.joints({"shoulder_right": -math.sin(number)}, node="/b")
        talk.steps(2)
    assert talk.at("shoulder_right") == pytest.approx(0.5, abs=1e-3)
    assert talk.node.commander.ignored == 200
    talk.enable()
    assert talk.top_speed("shoulder_right", 2.0, lambda: talk.joints({"shoulder_right": 0.9})) < 0.55
    assert talk.at("shoulder_right") == pytest.approx(0.9, abs=1e-3)


def test_second_writer_on_topic_is_refused() -> None:
    talk = Talk(safety=SafetySettings(one_commander=0.5))
    refused = 0
    for _ in range(50):
        talk.joints({"waist": 0.5}, node="/a")
        try:
            talk.joints({"waist": -0.5}, node="/b")
        except RejectedCommandError:
            refused += 1
        talk.steps(2)
    talk.seconds(0.4)
    assert refused == 50
    assert talk.at("waist") == pytest.approx(0.5, abs=1e-3)
    assert any("/b" in line and "/a commands this topic" in line for line in talk.lines), "the refusal is not logged"
    talk.seconds(0.2)
    talk.joints({"waist": -0.5}, node="/b")


def test_lost_connection_holds_robot_and_resumes_slowly() -> None:
    """The robot holds while the connection is lost, and resumes slowly: much may have changed."""
    talk = Talk(safety=SafetySettings(silence=0.5, resume_speed=0.5))
    status = talk.listen("status")
    for _ in range(100):
        talk.joints({"waist": 0.8})
        talk.seconds(0.01)
    talk.joints({"waist": -0.9})
    talk.seconds(0.2)
    moving = talk.at("waist")
    assert abs(talk.velocity("waist")) > 1.0
    talk.seconds(0.4)
    held = talk.at("waist")
    talk.seconds(5.0)
    assert talk.at("waist") == pytest.approx(held, abs=1e-3)
    assert held < moving
    assert status[-1].silent
    assert status[-1].message == "joints are held: no message on /io_teleop/joint_cmd"
    assert sum(": its joints are held" in line for line in talk.lines) == 1
    fastest = talk.top_speed("waist", 2.0, lambda: talk.joints({"waist": 0.9}))
    assert fastest < 0.55, "2 rad/s otherwise"
    assert talk.at("waist") > held + 0.5
    assert not status[-1].silent
    talk.joints({"waist": -0.9})
    talk.seconds(5.0)
    assert talk.at("waist") > -0.5, "the second loss is not held"
    assert sum(": its joints are held" in line for line in talk.lines) == 2


def test_lost_connection_keeps_gripper_closed() -> None:
    talk = Talk(safety=SafetySettings(silence=0.5))
    talk.grippers(1.0, 0.0)
    talk.joints({"head": 0.3})
    talk.seconds(3.0)
    assert talk.applied("finger_right") == 0.04
    assert talk.at("finger_right") == pytest.approx(0.04, abs=1e-4)


def test_lost_connection_holds_arm_on_its_way_to_pose() -> None:
    talk = Talk(safety=SafetySettings(silence=0.25))
    heard = talk.listen("state_ee_poses")
    talk.steps(3)
    poses = heard[-1].poses
    far = [replace(pose, position=replace(pose.position, z=pose.position.z + 0.4)) for pose in poses]

    def command() -> None:
        talk.node.bus.publish("/io_teleop/target_ee_poses", PoseArray(stamped(0.0), far), node="/op")

    command()
    assert talk.top_speed("shoulder_right", 0.2) > 0.3
    talk.seconds(0.2)
    held = talk.at("shoulder_right")
    talk.seconds(2.0)
    assert talk.at("shoulder_right") == pytest.approx(held, abs=1e-3)
    assert any("no message on /io_teleop/target_ee_poses for 0.25 s" in line for line in talk.lines)
    talk.top_speed("shoulder_right", 1.0, command)
    assert abs(talk.at("shoulder_right") - held) > 0.1


def test_silent_topic_is_held_while_another_is_active() -> None:
    talk = Talk(safety=SafetySettings(silence=0.5, max_speeds=(("shoulder_right", 0.2),)))
    talk.joints({"shoulder_right": -1.5})
    for _ in range(100):
        talk.joints({"head": 0.5}, "target_joint_from_vr")
        talk.seconds(0.01)
    assert talk.at("shoulder_right") == pytest.approx(0.4, abs=0.02), "held after 0.5 s"
    assert talk.at("head") == pytest.approx(0.5, abs=1e-3)
    assert not talk.node.commander.watchdog.is_all_silent


def test_joints_taken_over_by_another_topic_are_not_reported_held() -> None:
    talk = Talk(safety=SafetySettings(silence=0.5))
    status = talk.listen("status")
    talk.joints({"head": 0.1, "waist": 0.1})
    talk.seconds(1.0)
    assert status[-1].message == "joints are held: no message on /io_teleop/joint_cmd"

    def last_status(*joints: str) -> str:
        for _ in range(20):
            talk.joints(dict.fromkeys(joints, 0.2), "target_joint_from_vr")
            talk.seconds(0.02)
        return str(status[-1].message)

    assert last_status("head") == "joints are held: no message on /io_teleop/joint_cmd"  # the waist is
    assert last_status("head", "waist") == "follows /op"


@pytest.mark.parametrize("guard", list(Guard))
def test_far_first_command_does_not_jump(guard: Guard) -> None:
    talk = Talk(safety=SafetySettings(start_guard=0.8, guard=guard, resume_speed=0.4))
    if guard is Guard.REFUSE:
        with pytest.raises(RejectedCommandError, match=r"shoulder_right would jump by 1.5 at the start .* 0.8"):
            talk.joints({"shoulder_right": -1.0, "head": 0.1})
        talk.seconds(0.5)
        assert talk.at("head") == pytest.approx(0.0, abs=1e-6), "refused whole"
        talk.joints({"shoulder_right": 0.2})
        talk.joints({"shoulder_right": -1.0})
    else:
        talk.joints({"shoulder_right": -1.0, "head": 0.1})
        assert talk.top_speed("shoulder_right", 1.0) < 0.45
        assert talk.at("head") == pytest.approx(0.1, abs=1e-3)
        talk.seconds(3.0)
    talk.seconds(1.0)
    assert talk.at("shoulder_right") == pytest.approx(-1.0, abs=1e-3)


def test_first_command_after_reset_is_guarded() -> None:
    talk = Talk(safety=SafetySettings(start_guard=0.8))
    talk.joints({"shoulder_right": -0.2})
    talk.joints({"shoulder_right": -1.0})
    talk.seconds(1.0)
    talk.wait_for(talk.reset())
    with pytest.raises(RejectedCommandError, match="would jump"):
        talk.joints({"shoulder_right": -1.0})


def test_max_speeds_limit_matching_joints_only() -> None:
    talk = Talk(safety=SafetySettings(max_speeds=(("shoulder_*", 0.5), ("head", 1000.0))))
    talk.joints({"shoulder_right": -1.0, "shoulder_left": -1.0, "waist": 0.9})
    assert talk.top_speed("shoulder_right", 1.0) == pytest.approx(0.5, rel=0.02)
    assert talk.at("waist") == pytest.approx(0.9, abs=1e-3)
    talk.seconds(3.0)
    assert talk.at("shoulder_left") == pytest.approx(-1.0, abs=1e-3)


def test_queued_commands_with_old_stamps_are_refused() -> None:
    talk = Talk(safety=SafetySettings(max_age=0.2))
    talk.seconds(2.0)
    for late in range(10):
        with pytest.raises(RejectedCommandError, match=r"must be at most 0\.2 s old"):
            talk.joints({"waist": 0.5}, at=(late + 1) * 100_000_000)
    talk.joints({"waist": 0.3}, at=talk.node.simulation.now)
    talk.seconds(1.0)
    assert talk.at("waist") == pytest.approx(0.3, abs=1e-3)


def test_released_emergency_button_does_not_stop() -> None:
    talk = Talk()
    talk.stop(pressed=False)
    talk.joints({"waist": 0.5})
    talk.seconds(1.0)
    assert talk.at("waist") == pytest.approx(0.5, abs=1e-3)


def test_cleared_emergency_stop_does_not_jump() -> None:
    talk = Talk()
    talk.joints({"shoulder_right": -1.9, "finger_left": 0.04})
    talk.seconds(0.3)
    assert abs(talk.velocity("shoulder_right")) > 2.0
    before = talk.at("shoulder_right")
    talk.stop()
    assert talk.top_speed("shoulder_right", 1.0) < 3.1
    held = talk.at("shoulder_right")
    assert abs(held - before) < 0.15
    assert abs(talk.velocity("shoulder_right")) < 1e-3
    talk.joints({"shoulder_right": 1.5})
    talk.stop(pressed=False)
    talk.seconds(0.5)
    assert talk.at("shoulder_right") == pytest.approx(held, abs=1e-3), (
        "commands are ignored, and the released button clears nothing"
    )
    assert not talk.enable().success
    assert talk.clear().success
    assert talk.top_speed("shoulder_right", 1.0) < 1e-3
    fastest = talk.top_speed("shoulder_right", 1.0, lambda: talk.joints({"shoulder_right": 1.5}))
    assert 0.4 < fastest < 0.55
    assert talk.clear().message == "there was no emergency stop"


def test_switching_command_topics_with_guard_does_not_jump() -> None:
    talk = Talk(safety=SafetySettings(start_guard=0.8, guard=Guard.BLEND, resume_speed=0.4))
    talk.joints({"elbow_left": -0.9})
    talk.seconds(0.5)
    fastest = talk.top_speed("elbow_left", 1.0, lambda: talk.joints({"elbow_left": 1.5}, "target_joint_from_vr"))
    assert fastest < 0.45


def test_clutch_after_pause_continues_from_held_position() -> None:
    """With the clutch a user stops, moves the controller back, and continues from there."""
    talk = Talk(safety=SafetySettings(clutch=True, silence=0.25))
    for number in range(50):
        talk.joints({"waist": 0.01 * number})
        talk.seconds(0.01)
    talk.seconds(1.0)
    held = talk.at("waist")
    assert held > 0.3
    assert talk.top_speed("waist", 0.2, lambda: talk.joints({"waist": 0.0})) < 1e-3
    for number in range(40):
        talk.joints({"waist": 0.01 * number})
        talk.seconds(0.01)
    assert talk.at("waist") == pytest.approx(held + 0.39, abs=0.05)


def test_repeated_resets_during_motion_succeed() -> None:
    talk = Talk()
    for number in range(30):
        talk.joints({"shoulder_right": -1.5})
        talk.seconds(0.05)
        pending = talk.reset()
        talk.seconds(0.02 * (number % 3))
    assert talk.wait_for(pending).success


def test_joint_moves_in_every_step_after_one_message() -> None:
    talk = Talk()
    talk.joints({"waist": 0.9})
    talk.seconds(0.2)
    positions = set()
    for _ in range(24):
        talk.steps()
        positions.add(round(talk.at("waist"), 9))
    assert len(positions) == 24


def test_stop_outranks_disabling_and_commands_are_counted_as_ignored() -> None:
    talk = Talk(safety=SafetySettings(start_disabled=True))
    commander = talk.node.commander
    assert commander.why_ignored.endswith(ENABLE)
    talk.stop()
    assert commander.why_ignored.endswith(CLEAR_STOP)
    assert not commander.admit("/io_teleop/joint_cmd", "/op", 0)
    talk.clear()
    talk.enable()
    assert commander.why_ignored == ""
    assert commander.admit("/io_teleop/joint_cmd", "/op", 0)
    assert (commander.taken, commander.ignored) == (0, 1), "an admitted command counts when it was carried out"
