"""Keys and gamepad of a browser: their messages, and the velocity that they ask for."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from cellwright.viewer.web.input import COMMANDS, FAST, JOG_SPEED, JOG_TURN, MARK, SCRIPT, Input, jog, read_input

NONE = [0.0] * 6


def message(**fields: Any) -> bytes:
    none = {"type": "OperatorInputMessage", "values": NONE, "pressed": [], "fast": False}
    return msgspec.msgpack.encode({**none, **fields})


def test_message_of_script_is_read() -> None:
    found = read_input(message(values=[1, 0, -1, 0, 0, 0.5], pressed=["grip"], fast=True))
    assert found == Input((1.0, 0.0, -1.0, 0.0, 0.0, 0.5), ["grip"], True)


@pytest.mark.parametrize(
    "data",
    [
        message(values=[1.0] * 5),
        message(values=[9.0, *NONE[1:]]),
        message(values=[float("nan"), *NONE[1:]]),
        message(pressed=["reboot"]),
        message(pressed=["grip"] * 9),
        message(fast=1),
        message(more=1),
        message()[:-1],
        msgspec.msgpack.encode({"type": "ViewerCameraMessage"}),
        b"",
        "OperatorInputMessage",
    ],
)
def test_other_messages_move_nothing(data: bytes | str) -> None:
    assert read_input(data) is None


def test_velocity_is_limited_and_faster_with_shift() -> None:
    slow = Input((1.0, -2.0, 0.5, 0.0, 0.0, 1.0), [], False)
    linear, angular = jog(slow)
    assert linear == (JOG_SPEED, -JOG_SPEED, JOG_SPEED / 2)
    assert angular == (0.0, 0.0, JOG_TURN)
    fast, _ = jog(Input(slow.values, [], True))
    assert fast[0] == FAST * JOG_SPEED


def test_script_knows_the_mark_and_the_commands() -> None:
    text = SCRIPT.decode()
    assert MARK.split('"')[1] in text
    assert all(f'"{each}"' in text for each in COMMANDS)
