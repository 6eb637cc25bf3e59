"""Text of a robot's state: readable at a glance, without foreign markup that a browser would execute."""

from typing import Any

import pytest

from cellwright.viewer.web.operator.command_queue import CommandQueue
from cellwright.viewer.web.operator.feature import pill, state_html
from cellwright.viewer.web.widgets import AMBER, GREEN, GREY, RED
from tests.viewer.web.operator.robots import Clock, seen, state


@pytest.mark.parametrize(
    ("changes", "colour"),
    [
        ({"is_stopped": True, "is_enabled": False}, RED),
        ({"is_enabled": False}, AMBER),
        ({"is_homing": True}, AMBER),
        ({"is_silent": True}, AMBER),
        ({"commander": "/vr"}, GREEN),
        ({}, GREY),
    ],
)
def test_pill_has_colour_of_state(changes: dict[str, Any], colour: str) -> None:
    assert pill(state(**changes))[1] == colour
    assert pill(None) == ("not connected", GREY)


def test_foreign_names_in_state_are_escaped() -> None:
    queue = CommandQueue(seen(), Clock())
    queue.see(state(commander="/<img src=x onerror=alert(1)>", refused=3, ignored=2))
    queue.refused("<script>")
    queue.delay.begin(state(), 0.0)
    queue.delay.look(state(positions=tuple(9.0 for _ in state().positions)), 0.042)
    html = state_html(queue, 101.0)
    assert "<img" not in html
    assert "<script" not in html
    assert "&lt;script&gt;" in html
    for expected in ("3 refused", "2 ignored", "delay 42 ms", "/&lt;img"):
        assert expected in html


def test_state_html_has_reason_for_hold() -> None:
    queue = CommandQueue(seen(), Clock())
    assert "not connected" in state_html(queue, 0.0)
    queue.see(state(is_enabled=False, message="commands are disabled; call /io_teleop/set_enabled to enable them"))
    assert "set_enabled" in state_html(queue, 0.0)
