"""Time controls, at the top of the panel: over a real viser, which refuses what it cannot do."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.viewer.web.time_controls import CONFIRM_RESTART, RESTART, SPEEDS, TimeControls, clock, seconds_of
from tests.viewer.web.pages import clicked, page


def panel(**refused: str) -> dict[str, Any]:
    control = {"paused": False, "ticks_left": 0, "speed": 1.0, "lockstep": False, "resets": 0, "refused": refused}
    return {"kind": "cell", "clock": {"time": 1.0}, "control": control}


@pytest.fixture(scope="module")
def opened() -> Iterator[tuple[Any, TimeControls]]:
    with page() as found:
        controls = TimeControls()
        controls.page = found
        controls.on_scene(None)  # type: ignore[arg-type]
        controls.panel(panel())
        yield found, controls


def test_refused_actions_are_hidden(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened

    def offered() -> list[bool]:
        return [controls._steps.visible, controls._speeds.visible]

    controls.panel(panel(pause="a real robot's time passes", speed="a real robot's time passes"))
    assert offered() == [False, False]
    controls.panel(panel())
    assert offered() == [True, True]


def test_time_controls_after_run_are_hidden(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    refused = dict.fromkeys(("pause", "resume", "step", "speed"), "the run is over")
    shown = panel(**refused)
    shown["control"]["over"] = "the run is over"
    controls.panel(shown)
    assert [controls._steps.visible, controls._speeds.visible, controls._reset.visible] == [False, False, True]
    assert "the run is over: the page shows the final state" in controls._clock.content
    assert "running" not in controls._clock.content
    controls.panel(panel())
    assert "running" in controls._clock.content


def test_time_controls_after_disconnect_are_hidden_until_reconnect(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    controls.panel(panel())
    controls.on_disconnect("the node has stopped")
    assert [controls._steps.visible, controls._speeds.visible, controls._reset.visible] == 3 * [False]
    assert "1.00" in controls._clock.content
    assert "not connected" in controls._clock.content
    assert "the node has stopped" in controls._clock.content
    controls.panel(panel())
    assert [controls._steps.visible, controls._speeds.visible, controls._reset.visible] == 3 * [True]
    TimeControls().on_disconnect("never connected")


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("Pause", {"action": "pause"}),
        ("Resume", {"action": "resume"}),
        ("Step", {"action": "step", "ticks": 1}),
        ("1 s", {"action": "step", "ticks": 500}),
    ],
)
def test_click_sends_its_action(word: str, expected: dict[str, Any], opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.requests.clear()
    clicked(controls._steps, word)
    assert found.link.requests == [expected]


def test_speed_button_sends_its_factor(opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.requests.clear()
    for word in SPEEDS:
        clicked(controls._speeds, word)
    assert [each["factor"] for each in found.link.requests] == [0.1, 0.5, 1.0, 2.0, 10.0, "max"]


def test_second_click_on_restart_resets(opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.requests.clear()
    clicked(controls._reset, True)
    controls.panel(panel())
    assert (found.link.requests, controls._reset.label) == ([], CONFIRM_RESTART)
    clicked(controls._reset, True)
    controls.panel(panel())
    assert (found.link.requests, controls._reset.label) == ([{"action": "reset"}], RESTART)
    clicked(controls._reset, True)
    controls._first_click -= 10.0
    clicked(controls._reset, True)
    assert len(found.link.requests) == 1


def test_refused_reset_disables_button_with_reason(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    controls.panel(panel(reset="not available in competition mode"))
    assert (controls._reset.disabled, controls._reset.hint) == (True, "not available in competition mode")


def test_refused_action_is_notified(opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.refuses = "not here"
    clicked(controls._steps, "Pause")
    found.link.refuses = ""
    assert found.notices[-1] == ("pause: refused", "not here")


def test_recording_has_timeline_that_follows_and_seeks() -> None:
    with page() as found:
        controls = TimeControls()
        controls.page = found
        controls.on_scene(None)  # type: ignore[arg-type]
        shown = {**panel(), "kind": "recording", "begin": 0.0, "end": 20.0, "time": 5.04}
        del shown["clock"]
        controls.panel(shown)
        assert controls._slider.value == 5.0
        assert found.link.requests == [], "it follows, and asks for nothing"
        clicked(controls._slider, 12.5)
        assert found.link.requests == [{"action": "seek", "time": 12.5}]
        controls.panel(shown)
        assert controls._slider.value == 12.5, "it stays under the browser's pointer"


def test_timeline_follows_change_of_served_recording() -> None:
    with page() as found:
        controls = TimeControls()
        controls.page = found
        controls.on_scene(None)  # type: ignore[arg-type]

        def ends() -> tuple[bool, float, float]:
            return controls._slider.visible, controls._slider.min, controls._slider.max

        recording = {**panel(), "kind": "recording", "begin": 0.0, "end": 20.0, "time": 5.0}
        del recording["clock"]
        controls.panel(recording)
        assert ends() == (True, 0.0, 20.0)
        controls.panel({**recording, "begin": 30.0, "end": 90.0, "time": 45.0})
        assert (ends(), controls._slider.value) == ((True, 30.0, 90.0), 45.0)
        controls.panel(panel())
        assert not controls._slider.visible, "a cell has none"


def test_seconds_of_reads_time_of_each_panel_kind() -> None:
    assert seconds_of({"kind": "cell", "clock": {"time": 2.5}}) == 2.5
    assert seconds_of({"kind": "robot", "time": 2_500_000_000}) == 2.5
    assert seconds_of({"kind": "recording", "time": 2.5}) == 2.5


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        ({}, "running"),
        ({"paused": True}, "paused"),
        ({"paused": True, "ticks_left": 3}, "stepping"),
        ({"lockstep": True}, "lockstep"),
        ({"speed": "max"}, "as fast as possible"),
        ({"speed": 0.1}, "target 0.1 ×"),
    ],
)
def test_clock_shows_state_and_speed(state: dict[str, Any], expected: str) -> None:
    html = clock(12.3456, panel()["control"] | state, 0.987)
    assert expected in html
    assert "12.35" in html
    assert ("1.0 × real time" in html) == (not state.get("paused"))


def test_panel_of_another_version_is_ignored(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    controls.panel({"kind": "cell", "clock": {}, "control": panel()["control"]})
    controls.panel({"kind": "robot", "time": "now", "control": panel()["control"]})
    controls.panel({"kind": "cell"})
