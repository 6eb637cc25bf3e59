"""Homing: the response comes when the robot is home, or has failed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cellwright.robot.homing import HOME_TOLERANCE, HOMING_RESPONSE, MAX_WAITING_CALLS
from cellwright.robot.safety import SafetySettings
from cellwright.robot.servos import Motion
from tests.robot.robots import bare, two_arms
from tests.robot.talk import Talk

FAR = {"shoulder_right": -1.8, "elbow_left": 1.9, "waist": 0.9, "lift": 0.4, "head": -1.4, "wheel": 2.0}


def away_from_home(**more: object) -> Talk:
    talk = Talk(**more)  # type: ignore[arg-type]
    talk.joints(FAR)
    talk.grippers(1.0, 0.5)
    talk.seconds(2.0)
    return talk


@pytest.mark.parametrize("motion", list(Motion))
def test_reset_responds_when_all_groups_are_home(motion: Motion) -> None:
    talk = away_from_home(motion=motion)
    started = talk.node.simulation.time
    answer = talk.wait_for(talk.reset())
    assert (answer.success, answer.message) == (True, "Service successfully triggered!")
    assert answer.message == HOMING_RESPONSE
    assert talk.node.simulation.time - started < (2.0 if motion is Motion.SERVO else 0.1)
    home = {"shoulder_right": 0.5, "elbow_left": -1.0, "waist": 0.0, "lift": 0.1, "head": 0.1, "finger_right": 0.0}
    assert {name: talk.at(name) for name in home} == pytest.approx(home, abs=HOME_TOLERANCE)
    assert talk.at("wheel") == pytest.approx(2.0, abs=1e-3), "a joint without group moved"


def test_commands_during_reset_are_ignored_and_discarded() -> None:
    talk = away_from_home()
    pending = talk.reset()
    taken = talk.node.commander.taken
    while pending.response is None:
        talk.joints(FAR)
        talk.steps()
    assert pending.response.success
    assert talk.node.commander.taken == taken
    assert talk.node.commander.ignored > 50
    talk.seconds(1.0)
    assert talk.at("shoulder_right") == pytest.approx(0.5, abs=1e-3), "an old target is followed"
    talk.joints({"shoulder_right": 1.0})
    talk.seconds(1.0)
    assert talk.at("shoulder_right") == pytest.approx(1.0, abs=1e-3)


def test_number_of_waiting_reset_calls_is_limited() -> None:
    talk = away_from_home()
    calls = [talk.reset() for _ in range(MAX_WAITING_CALLS)]
    answer = talk.reset()
    assert (answer.success, answer.message) == (
        False,
        "too many calls wait for the reset (at most 1000); call again when the robot is home",
    )
    talk.wait_for(calls[-1])
    assert all(pending.response.success for pending in calls)
    assert talk.wait_for(talk.reset()).success


def test_two_resets_during_motion_share_one_homing() -> None:
    talk = Talk()
    talk.joints(FAR)
    talk.seconds(0.15)
    assert abs(talk.velocity("shoulder_right")) > 1.0
    first = talk.reset()
    talk.seconds(0.1)
    second = talk.reset()
    assert talk.wait_for(first).success
    assert second.response.success, "the second call failed"
    assert sum("goes home" in line for line in talk.lines) == 1


def test_reset_at_home_responds_in_next_tick() -> None:
    talk = away_from_home()
    talk.wait_for(talk.reset())
    pending = talk.reset()
    talk.steps(1)
    assert pending.response.success


@pytest.mark.slow
def test_reset_timeout_fails_and_robot_holds() -> None:
    talk = away_from_home(safety=SafetySettings(max_speeds=(("shoulder_*", 0.1),)))
    talk.joints({"shoulder_right": -1.8})
    talk.seconds(20.0)
    started = talk.node.simulation.time
    answer = talk.wait_for(talk.reset())
    assert talk.node.simulation.time - started == pytest.approx(5.0, abs=0.01)
    assert not answer.success
    assert answer.message.startswith("not at home after 5 s: shoulder_right is 1.7")
    held = talk.at("shoulder_right")
    talk.seconds(1.0)
    assert talk.at("shoulder_right") == pytest.approx(held, abs=0.02)
    assert talk.wait_for(talk.reset()).success is False
    assert talk.at("shoulder_right") > held + 0.4, "the second reset does not continue"


def test_slow_motion_is_not_taken_for_home() -> None:
    talk = Talk(safety=SafetySettings(max_speeds=(("waist", 0.008),)))
    talk.wait_for(talk.reset())
    talk.joints({"waist": 0.02})
    talk.seconds(3.0)
    started = talk.node.simulation.time
    assert talk.wait_for(talk.reset()).success
    assert talk.node.simulation.time - started > 2.0


def test_reset_lets_joints_without_group_reach_targets() -> None:
    talk = Talk(safety=SafetySettings(silence=0.2, max_speeds=(("wheel", 1.0), ("shoulder_right", 0.5))))
    talk.joints({"wheel": 1.5, "shoulder_right": 0.45})
    talk.seconds(0.15)
    talk.joints({"shoulder_right": -0.2})
    talk.seconds(0.15)
    talk.joints({"shoulder_right": -0.2})
    talk.wait_for(talk.reset())
    talk.seconds(2.0)
    assert talk.at("wheel") == pytest.approx(1.5, abs=1e-3)


def test_stopped_or_disabled_reset_fails_with_reason() -> None:
    talk = away_from_home()
    pending = talk.reset()
    talk.seconds(0.1)
    talk.stop()
    talk.steps(1)
    assert not pending.response.success
    assert pending.response.message == "the reset was interrupted: emergency stop by /op"
    assert talk.reset().message.startswith("the emergency stop is active")
    talk.clear()
    pending = talk.reset()
    talk.seconds(0.05)
    talk.enable(enabled=False)
    talk.steps(1)
    assert pending.response.message == "the reset was interrupted: commands are disabled"


def test_reset_after_cleared_stop_fails_old_call_and_succeeds() -> None:
    talk = away_from_home()
    first = talk.reset()
    talk.stop()
    talk.clear()
    second = talk.reset()
    assert not first.response.success
    assert talk.wait_for(second).success


def test_waiting_callers_get_a_response_when_the_node_stops_or_is_reset() -> None:
    talk = away_from_home()
    pending = talk.reset()
    talk.node.simulation.reset()
    assert pending.response.message == "the node was reset"
    talk.joints(FAR)
    talk.seconds(1.0)
    pending = talk.reset()
    talk.node.close()
    assert pending.response.message == "the node has stopped"


def test_home_beyond_limits_is_clipped() -> None:
    config = two_arms()
    right = replace(config.arms[0], home=(0.5, -7.0, 0.2))
    talk = Talk(replace(config, arms=(right, config.arms[1])))
    talk.joints({"elbow_right": 0.0})
    talk.seconds(1.0)
    assert talk.wait_for(talk.reset()).success
    assert talk.at("elbow_right") == pytest.approx(-2.0, abs=HOME_TOLERANCE)


def test_robot_without_groups_is_always_home() -> None:
    talk = Talk(bare(two_arms()))
    talk.joints({"waist": 0.5})
    talk.seconds(1.0)
    assert talk.wait_for(talk.reset()).success
    assert talk.at("waist") == pytest.approx(0.5, abs=1e-3)


def test_status_reports_reset() -> None:
    talk = away_from_home()
    heard = talk.listen("status")
    talk.reset()
    talk.seconds(0.15)
    assert heard[-1].resetting
    assert heard[-1].message == "on its way home; commands are ignored meanwhile"
    talk.seconds(2.0)
    assert not heard[-1].resetting
