"""Commands: note, store and execute again."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.clock import Clock
from cellwright.middleware.bus import Bus, ExternalInput, InputKind
from cellwright.middleware.messages.standard import Bool
from cellwright.middleware.messages.std_srvs import SetBoolRequest, SetBoolResponse
from cellwright.recording.format.commands import Command, note_commands
from cellwright.util.errors import RecordingError, RejectedCommandError

GOOD = {"tick": 3, "kind": "publish", "name": "/a", "type": "std_msgs/Bool", "node": "/n", "stamp": None, "data": ""}


def noted() -> tuple[Bus, list[Command], list[Any], Callable[[], None]]:
    """Return a bus with a topic and a service, the noted commands, and their effects."""
    clock = Clock(Fraction(1, 100))
    done: list[Any] = []
    commands: list[Command] = []
    bus = Bus(lambda: clock.now)

    def hear(message: Any, node: str) -> None:
        done.append((message.data, node, len(commands)))
        if not message.data:
            raise RejectedCommandError("no")

    def answer(request: Any, node: str) -> SetBoolResponse:
        done.append((request.data, node, len(commands)))
        return SetBoolResponse(success=True, message="")

    bus.listen("/hear", "std_msgs/Bool", hear)
    bus.serve("/serve", "std_srvs/SetBool", answer)
    clock.set_tick(7)
    return bus, commands, done, note_commands(bus, clock, commands.append, lambda: 99)


def test_command_is_noted_before_execution_even_if_refused() -> None:
    bus, commands, done, leave = noted()
    bus.publish("/hear", Bool(data=True), node="/a")
    with pytest.raises(RejectedCommandError):
        bus.publish("/hear", Bool(data=False), node="/b")
    bus.call("/serve", SetBoolRequest(data=True), node="/c")
    bus.note(ExternalInput(InputKind.EXTRA, "cellwright/place", {"joints": [1]}, "/d"))
    with pytest.raises(RejectedCommandError):
        bus.publish("/hear", SetBoolRequest(data=True), node="/e")  # of the wrong type
    assert done == [(True, "/a", 1), (False, "/b", 2), (True, "/c", 3)]
    assert [(each.tick, each.kind, each.name, each.type, each.node, each.stamp) for each in commands] == [
        (7, InputKind.PUBLISH, "/hear", "std_msgs/Bool", "/a", 99),
        (7, InputKind.PUBLISH, "/hear", "std_msgs/Bool", "/b", 99),
        (7, InputKind.CALL, "/serve", "std_srvs/SetBool", "/c", 99),
        (7, InputKind.EXTRA, "cellwright/place", "", "/d", 99),
    ]
    leave()
    bus.publish("/hear", Bool(data=True))
    assert len(commands) == 4


def test_noted_commands_can_be_executed_again() -> None:
    bus, commands, _, _ = noted()
    bus.publish("/hear", Bool(data=True), node="/a")
    with pytest.raises(RejectedCommandError):
        bus.publish("/hear", Bool(data=False), node="/b")
    bus.call("/serve", SetBoolRequest(data=False), node="/c")
    bus.note(ExternalInput(InputKind.EXTRA, "cellwright/place", {"joints": [1]}, "/d"))
    again, _, done, _ = noted()
    asked: list[Any] = []
    for command in commands:
        Command.decode(command.encode()).carry_out(again, {"cellwright/place": asked.append})
    assert [each[:2] for each in done] == [(True, "/a"), (False, "/b"), (False, "/c")]
    assert asked == [{"joints": [1]}]
    with pytest.raises(RecordingError, match="not supported here"):
        commands[-1].carry_out(again)


@given(
    tick=st.integers(0, 1 << 60),
    kind=st.sampled_from(InputKind),
    words=st.tuples(st.text(), st.text(), st.text()),
    data=st.binary(),
    stamp=st.none() | st.integers(),
)
def test_command_survives_encoding(
    tick: int, kind: InputKind, words: tuple[str, str, str], data: bytes, stamp: int | None
) -> None:
    command = Command(tick, kind, *words, data, stamp)
    assert Command.decode(command.encode()) == command


@pytest.mark.parametrize(
    "change",
    [{"tick": -1}, {"tick": True}, {"tick": "3"}, {"kind": "sing"}, {"name": 3}, {"data": "?"}, {"stamp": 1.5}],
)
def test_text_of_invalid_command_is_refused(change: dict[str, Any]) -> None:
    assert Command.decode(json.dumps(GOOD)).tick == 3
    with pytest.raises(RecordingError, match="invalid command"):
        Command.decode(json.dumps(GOOD | change))


@pytest.mark.parametrize("text", ["", "[]", "{}", "3", "[" * 100_000])
def test_text_that_is_not_json_is_refused(text: str) -> None:
    with pytest.raises(RecordingError, match="invalid command"):
        Command.decode(text)


@pytest.mark.parametrize(
    "command",
    [
        Command(1, InputKind.PUBLISH, "/hear", "std_msgs/Bool", "/n", b""),
        Command(1, InputKind.PUBLISH, "/hear", "no_such/Type", "/n", b"\0\1\0\0\1"),
        Command(1, InputKind.CALL, "/serve", "std_msgs/Bool", "/n", b"\0\1\0\0\1"),
        Command(1, InputKind.EXTRA, "cellwright/place", "", "/n", b"[1]"),
        Command(1, InputKind.EXTRA, "cellwright/place", "", "/n", b"\xff"),
    ],
)
def test_command_with_invalid_content_is_reported_in_one_line(command: Command) -> None:
    with pytest.raises(RecordingError, match=r"invalid command on .* at tick 1") as caught:
        command.carry_out(noted()[0])
    assert "\n" not in str(caught.value)
