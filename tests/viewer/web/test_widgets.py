"""Pieces of the panel, and the behaviour of viser that they rely on: it sends changes only."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import viser

from cellwright.viewer.web import widgets

GUI: dict[str, Callable[[Any], Any]] = {
    "html": lambda gui: gui.add_html("a"),
    "button": lambda gui: gui.add_button("a", hint="a"),
    "group": lambda gui: gui.add_button_group("a", ("x", "y")),
    "checkbox": lambda gui: gui.add_checkbox("a", initial_value=False),
    "slider": lambda gui: gui.add_slider("a", min=0.0, max=1.0, step=0.1, initial_value=0.5),
}


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def queued(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    found: list[Any] = []
    monkeypatch.setattr(server._websock_server, "queue_message", found.append)
    return found


@pytest.mark.parametrize(
    ("kind", "attribute", "value"),
    [
        ("html", "content", "b"),
        ("html", "visible", False),
        ("button", "label", "b"),
        ("button", "color", "red"),
        ("button", "disabled", True),
        ("button", "hint", "b"),
        ("group", "visible", False),
        ("checkbox", "value", True),
        ("slider", "value", 0.7),
        ("slider", "min", 0.2),
        ("slider", "max", 2.0),
        ("slider", "label", "b"),
    ],
)
def test_element_set_to_same_value_queues_no_message(
    server: viser.ViserServer, queued: list[Any], kind: str, attribute: str, value: Any
) -> None:
    handle = GUI[kind](server.gui)
    setattr(handle, attribute, value)
    queued.clear()
    setattr(handle, attribute, value)
    assert queued == []
    setattr(handle, attribute, getattr(GUI[kind](server.gui), attribute))
    assert queued


def test_node_set_to_same_value_queues_no_message(server: viser.ViserServer, queued: list[Any]) -> None:
    ball = server.scene.add_icosphere("/a", 0.1, visible=False)
    lines = server.scene.add_line_segments("/b", np.zeros((1, 2, 3), np.float32), (1.0, 0.0, 0.0))
    for value in (1.0, 2.0):
        queued.clear()
        for handle in (ball, lines):
            handle.visible = value > 1.0
            handle.position = np.full(3, value)
            handle.wxyz = np.array([0.0, value, 0.0, 0.0])
        lines.points = np.full((1, 2, 3), value, np.float32)
        ball.color = (round(value), 0, 0)
        assert queued
        queued.clear()
        for handle in (ball, lines):
            handle.visible = value > 1.0
            handle.position = np.full(3, value)
            handle.wxyz = np.array([0.0, value, 0.0, 0.0])
        lines.points = np.full((1, 2, 3), value, np.float32)
        ball.color = (round(value), 0, 0)
        assert queued == []


@pytest.mark.parametrize("piece", [widgets.text, widgets.big, widgets.title, widgets.dim, widgets.figures])
def test_foreign_markup_is_escaped(piece: Callable[[str], str]) -> None:
    assert "<script>" not in piece("<script>alert(1)</script>")
    assert "&lt;script&gt;" in piece("<script>alert(1)</script>")


@pytest.mark.parametrize(("share", "width"), [(-0.5, "0.0"), (0.25, "25.0"), (7.0, "100.0")])
def test_bar_stays_within_its_ground(share: float, width: str) -> None:
    assert f"width:{width}%" in widgets.bar(share, widgets.GREEN)
