"""Published topics: their content."""

from __future__ import annotations

import math
from typing import Any

import pytest

from cellwright.robot.publications import STATUS_PERIOD
from tests.robot.talk import Talk


def test_joint_states_list_movable_joints_in_index_order() -> None:
    talk = Talk()
    heard = talk.listen("joint_states")
    talk.joints({"waist": 0.5})
    talk.seconds(0.1)
    robot = talk.node.config.robot
    last = heard[-1]
    assert last.name == [joint.name for joint in robot.joints if joint.type.value != "fixed"]
    assert "antenna" in last.name, "the ball joint is missing"
    assert len(last.position) == len(last.velocity) == len(last.effort) == len(last.name)
    place = last.name.index("waist")
    assert last.position[place] == pytest.approx(talk.at("waist"))
    assert last.velocity[place] == pytest.approx(talk.velocity("waist"))
    assert last.velocity[place] > 1.0
    assert max(abs(last.effort)) > 0.0
    assert not any(math.copysign(1.0, value) < 0.0 for value in last.position.tolist() if value == 0.0)
    assert (last.header.stamp.sec, last.header.stamp.nanosec) == (0, 100_000_000)


def test_states_are_published_at_100_hz_and_clock_each_step() -> None:
    talk = Talk()
    states, applied, clock = (talk.listen(name) for name in ("joint_states", "applied_joint_cmd", "/clock"))
    talk.seconds(2.0)
    assert (len(states), len(applied), len(clock)) == (200, 200, 480)
    assert clock[-1].clock.sec == 2


def test_joint_states_follow_clock_of_their_stamp() -> None:
    talk, received = Talk(), list[float]()
    clock = 0.0

    def tick(message: Any) -> None:
        nonlocal clock
        clock = message.clock.sec + message.clock.nanosec / 1e9

    def state(message: Any) -> None:
        received.append(message.header.stamp.sec + message.header.stamp.nanosec / 1e9 - clock)

    talk.node.bus.subscribe("/io_teleop/joint_states", state)
    talk.node.bus.subscribe("/clock", tick)
    talk.seconds(0.5)
    assert received == [0.0] * 50


def test_applied_targets_include_mimic_joints() -> None:
    talk = Talk()
    heard = talk.listen("applied_joint_cmd")
    talk.joints({"finger_left": 0.03})
    talk.seconds(0.05)
    targets = dict(zip(heard[-1].name, heard[-1].position.tolist(), strict=True))
    assert targets["finger_left"] == targets["thumb_left"] == 0.03
    assert "antenna" not in targets


def test_stamps_are_simulation_time_with_sim_time() -> None:
    talk = Talk()
    other = Talk(stamp=lambda: 1_700_000_000_000_000_001)
    first, second = talk.listen("joint_states"), other.listen("joint_states")
    talk.seconds(0.02)
    other.seconds(0.02)
    assert first[0].header.stamp.nanosec == 12_500_000
    assert second[0].header.stamp.nanosec == 12_500_000, "the stamp is not simulation time"


def test_status_is_published_on_change_at_10_hz_at_most() -> None:
    talk = Talk()
    heard = talk.listen("status")
    talk.seconds(1.0)
    assert [status.message for status in heard] == ["waits for commands"]
    for _ in range(120):
        talk.joints({"waist": 0.1})
        talk.steps(2)
    assert len(heard) - 1 == pytest.approx(1.0 / STATUS_PERIOD, abs=1)
    assert (heard[-1].commander, heard[-1].message) == ("/op", "follows /op")
    assert heard[-1].enabled
    talk.seconds(2.0)
    assert heard[-1].taken == 120
    assert heard[-1].commander == ""
    count = len(heard)
    talk.seconds(1.0)
    assert len(heard) == count
    late = talk.listen("status")
    assert late == [heard[-1]], "the status is not latched"


def test_status_counts_refused_and_ignored_input() -> None:
    talk = Talk()
    talk.joints({"unknown": 1.0, "waist": 0.1})
    with pytest.raises(Exception, match="same length"):
        talk.state("joint_cmd", ["waist"], [])
    talk.stop()
    talk.joints({"waist": 0.2})
    heard = talk.listen("status")
    talk.seconds(0.2)
    status = heard[-1]
    assert (status.taken, status.refused, status.ignored) == (1, 1, 1)
    assert status.unknown_names == ["unknown"]
    assert status.emergency_stop
    assert status.message == "emergency stop by /op; call /io_teleop/clear_emergency_stop to clear it"
    talk.clear()
    talk.seconds(0.2)
    assert heard[-1].message == "stop cleared; the robot holds until the next command"
    talk.enable(enabled=False)
    talk.seconds(0.2)
    assert heard[-1].message == "commands are disabled; call /io_teleop/set_enabled to enable them"
    talk.enable()
    talk.seconds(2.0)
    assert heard[-1].message == "waits for commands"
