"""Robot controller node: its state follows from its commands, and can be saved and restored."""

from __future__ import annotations

import json

import pytest

from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import Guard, SafetySettings
from cellwright.util.errors import RejectedCommandError
from tests.robot.robots import two_arms
from tests.robot.talk import Talk

SAFETY = SafetySettings(silence=0.1, max_speeds=(("*", 1.0),), max_age=None)


def run_scenario(talk: Talk) -> str:
    """Send commands of every kind; return the state hash at the end."""
    for number in range(60):
        talk.joints({"waist": 0.5 - 0.01 * number, "elbow_left": 3.0}, node=f"/op{number % 2}")
        talk.steps(2)
        if number == 20:
            talk.grippers(0.5, 1.0)
            talk.base(0.1, 0.2)
        if number == 30:
            talk.stop()
        if number == 33:
            talk.clear()
        if number == 45:
            talk.reset()
    return talk.node.simulation.state_hash()


def test_same_commands_give_same_state_with_or_without_subscribers() -> None:
    alone, watched = Talk(safety=SAFETY), Talk(safety=SAFETY)
    for info in watched.node.bus.topics():
        watched.listen(info.name)
    assert run_scenario(alone) == run_scenario(watched) == run_scenario(Talk(safety=SAFETY))


def test_restored_snapshot_continues_identically() -> None:
    talk = Talk(safety=SAFETY)
    talk.joints({"waist": 0.9, "elbow_left": -1.9})
    talk.base(0.3, 0.4)
    talk.steps(20)
    snapshot = take_snapshot(talk.node.simulation)
    json.dumps(snapshot.state)
    talk.base(0.1, 0.1)
    first = run_scenario(talk)
    talk.stop()
    restore_snapshot(talk.node.simulation, snapshot)
    assert not talk.node.commander.is_stopped
    talk.base(0.1, 0.1)
    assert run_scenario(talk) == first


def test_snapshot_restores_emergency_stop() -> None:
    talk = Talk()
    talk.stop()
    snapshot = take_snapshot(talk.node.simulation)
    talk.clear()
    restore_snapshot(talk.node.simulation, snapshot)
    assert talk.node.commander.is_stopped


def test_snapshot_restores_commander_of_topic() -> None:
    talk = Talk(safety=SafetySettings(one_commander=0.5))
    talk.joints({"waist": 0.1}, node="/a")
    snapshot = take_snapshot(talk.node.simulation)
    talk.seconds(0.6)
    talk.joints({"waist": 0.2}, node="/b")
    restore_snapshot(talk.node.simulation, snapshot)
    with pytest.raises(RejectedCommandError, match="/a commands this topic"):
        talk.joints({"waist": 0.2}, node="/b")


def test_state_hash_differs_after_different_commands() -> None:
    first, second = Talk(safety=SAFETY), Talk(safety=SAFETY)
    second.joints({"waist": 0.5})
    assert first.node.simulation.state_hash() != second.node.simulation.state_hash()


def test_made_with_is_json_of_settings() -> None:
    node = RobotNode(two_arms(), RobotSettings(safety=SafetySettings(guard=Guard.BLEND), node="/other", sim_time=True))
    made = json.loads(json.dumps(node.made_with))
    assert (made["motion"], made["timestep"], made["self_collision"]) == ("servo", [1, 240], False)
    assert (made["node"], made["sim_time"], made["driver"]) == ("/other", True, False)
    assert made["safety"]["guard"] == "blend"
