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


def test_what_may_not_be_done_is_not_offered(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened

    def offered() -> list[bool]:
        return [controls._steps.visible, controls._speeds.visible]

    controls.panel(panel(pause="a real robot's time passes", speed="a real robot's time passes"))
    assert offered() == [False, False]
    controls.panel(panel())
    assert offered() == [True, True]


def test_a_run_that_is_over_is_not_running_and_has_nothing_to_press(opened: tuple[Any, TimeControls]) -> None:
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


def test_what_is_gone_offers_nothing_until_it_is_back(opened: tuple[Any, TimeControls]) -> None:
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
        ("Tick", {"action": "step", "ticks": 1}),
        ("1 s", {"action": "step", "ticks": 500}),
    ],
)
def test_a_click_is_asked_for(word: str, expected: dict[str, Any], opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.requests.clear()
    clicked(controls._steps, word)
    assert found.link.requests == [expected]


def test_each_speed_is_asked_for(opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.requests.clear()
    for word in SPEEDS:
        clicked(controls._speeds, word)
    assert [each["factor"] for each in found.link.requests] == [0.1, 0.5, 1.0, 2.0, 10.0, "max"]


def test_the_second_click_resets(opened: tuple[Any, TimeControls]) -> None:
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


def test_a_refused_reset_shows_its_reason(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    controls.panel(panel(reset="not available in competition mode"))
    assert (controls._reset.disabled, controls._reset.hint) == (True, "not available in competition mode")


def test_a_refusal_is_shown(opened: tuple[Any, TimeControls]) -> None:
    found, controls = opened
    found.link.refuses = "not here"
    clicked(controls._steps, "Pause")
    found.link.refuses = ""
    assert found.notices[-1] == ("pause: refused", "not here")


def test_a_recording_has_a_slider_that_follows_and_seeks() -> None:
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


def test_the_slider_is_that_of_what_is_served_there_now() -> None:
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


def test_time_of_each_kind_of_panel() -> None:
    assert seconds_of({"kind": "cell", "clock": {"time": 2.5}}) == 2.5
    assert seconds_of({"kind": "robot", "time": 2_500_000_000}) == 2.5
    assert seconds_of({"kind": "recording", "time": 2.5}) == 2.5


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        ({}, "running"),
        ({"paused": True}, "paused"),
        ({"paused": True, "ticks_left": 3}, "a step"),
        ({"lockstep": True}, "lockstep"),
        ({"speed": "max"}, "as fast as possible"),
        ({"speed": 0.1}, "asked 0.1 ×"),
    ],
)
def test_the_clock_says_how_time_passes(state: dict[str, Any], expected: str) -> None:
    html = clock(12.3456, panel()["control"] | state, 0.987)
    assert expected in html
    assert "12.35" in html
    assert ("1.0 × real time" in html) == (not state.get("paused"))


def test_a_panel_of_another_version_is_ignored(opened: tuple[Any, TimeControls]) -> None:
    _, controls = opened
    controls.panel({"kind": "cell", "clock": {}, "control": panel()["control"]})
    controls.panel({"kind": "robot", "time": "now", "control": panel()["control"]})
    controls.panel({"kind": "cell"})
