"""Command gate: admission of nodes, and age of commands."""

from __future__ import annotations

import json

import pytest

from cellwright.robot.safety import CommandGate, SafetySettings
from cellwright.util.errors import RejectedCommandError

SECOND = 1_000_000_000
TOPIC = "/io_teleop/joint_cmd"


class GateFixture:
    """Gate with clocks that are set by hand [s]."""

    def __init__(self, **safety: float) -> None:
        self.time = 100.0
        self.gate = CommandGate(SafetySettings(**safety), self.now, self.now)  # type: ignore[arg-type]

    def now(self) -> int:
        return round(self.time * SECOND)

    def take(self, node: str, stamp: float = 0.0, topic: str = TOPIC) -> None:
        self.gate.note_arrival()
        self.gate.check(topic, node, round(stamp * SECOND))
        self.gate.confirm(topic, node, round(stamp * SECOND))


def test_gate_admits_all_nodes_by_default() -> None:
    fixture = GateFixture()
    fixture.take("/a", stamp=1.0)
    fixture.take("/b", stamp=500.0)
    fixture.take("/a", stamp=0.5)
    assert fixture.gate.commanders == ("/a",)
    assert not fixture.gate.is_silent(TOPIC)


def test_second_commander_is_refused_until_first_is_silent() -> None:
    fixture = GateFixture(one_commander=0.5)
    fixture.take("/a")
    fixture.time += 0.5
    with pytest.raises(RejectedCommandError, match=r"/a commands this topic; others may after 0.5 s"):
        fixture.take("/b")
    fixture.take("/a")
    fixture.take("/b", topic="/io_teleop/target_joint_from_vr")
    fixture.time += 0.51
    fixture.take("/b")
    with pytest.raises(RejectedCommandError, match="/b commands this topic"):
        fixture.take("/a")


def test_refused_commands_do_not_extend_turn_of_commander() -> None:
    fixture = GateFixture(one_commander=0.5)
    fixture.take("/a")
    for _ in range(6):
        fixture.time += 0.1
        if fixture.time - 100.0 <= 0.5:
            with pytest.raises(RejectedCommandError):
                fixture.take("/b")
    fixture.take("/b")


@pytest.mark.parametrize(
    ("stamp", "reason"),
    [(99.0, "stamp must be at most 0.2 s old .got 1 s."), (101.0, "stamp is 1 s ahead of the node's clock")],
)
def test_stale_and_future_stamps_are_refused(stamp: float, reason: str) -> None:
    fixture = GateFixture(max_age=0.2)
    with pytest.raises(RejectedCommandError, match=reason):
        fixture.take("/a", stamp)
    fixture.take("/a", 99.9)
    fixture.take("/a", 0.0)  # without a stamp its age is not known


def test_stamp_older_than_previous_one_is_refused() -> None:
    fixture = GateFixture(max_age=0.2)
    fixture.take("/a", 99.95)
    fixture.take("/a", 99.95)
    with pytest.raises(RejectedCommandError, match=r"stamp is 0.05 s older than that of the previous command"):
        fixture.take("/a", 99.9)
    fixture.take("/b", 99.9)


def test_restarted_node_may_use_older_stamps() -> None:
    fixture = GateFixture(max_age=10.0)
    fixture.take("/a", 100.0)
    fixture.time += 1.5
    fixture.take("/a", 95.0)


def test_topic_is_silent_only_after_a_first_command() -> None:
    fixture = GateFixture(silence=0.5)
    assert not fixture.gate.is_silent(TOPIC)
    fixture.take("/a")
    fixture.time += 0.5
    assert not fixture.gate.is_silent(TOPIC)
    fixture.time += 0.01
    assert fixture.gate.is_silent(TOPIC)


def test_commanders_are_forgotten_after_a_second() -> None:
    fixture = GateFixture()
    fixture.take("/b")
    fixture.take("/a", topic="/io_teleop/target_gripper_status")
    assert list(fixture.gate.commanders) == ["/a", "/b"]
    fixture.time += 1.1
    assert not fixture.gate.commanders


def test_gate_restored_from_json_refuses_second_commander() -> None:
    first, second = GateFixture(one_commander=0.5), GateFixture(one_commander=0.5)
    first.take("/a", 99.0)
    second.gate.set_state(json.loads(json.dumps(first.gate.get_state())))
    with pytest.raises(RejectedCommandError):
        second.take("/b")
    second.gate.forget()
    second.take("/b")
