"""Operator tab: used controls send requests, following ones do not."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from cellwright.clients.operators.robot import Ask, MoveBase, MoveGrippers, MoveJoints
from cellwright.viewer.web.operator.command_queue import CommandQueue
from cellwright.viewer.web.operator.feature import Controls
from cellwright.viewer.web.operator.handles import Handles
from cellwright.viewer.web.operator.moves import BUTTON_RATE
from tests.viewer.web.operator.fakes import FakeGui, FakeScene
from tests.viewer.web.operator.robots import Clock, number, seen, state

ME = 3


class Tab:
    """Tab, with a command queue behind it."""

    def __init__(self, *, is_real: bool = False) -> None:
        self.clock, self.gui, self.stops, self.restart_refusal = Clock(), FakeGui(), 0, ""
        self.queue = CommandQueue(replace(seen(), is_real=is_real), self.clock)
        self.queue.see(state())
        self.handles = Handles(FakeScene(), "/scene", self.queue)
        self.controls = Controls(self.gui, nullcontext, self.queue, self.handles, self._stop)

    def _stop(self) -> str:
        self.stops += 1
        return self.restart_refusal

    def see(self, seconds: float = 1.0, **changes: Any) -> None:
        self.clock.now += seconds
        self.queue.see(state(time=round(self.clock.now * 1e9), **changes))
        self.controls.show(self.queue.state, self.clock.now)

    def slider(self, name: str) -> Any:
        hint = f"{name}:"
        return next(each for each in self.gui.made if each.kind == "slider" and each.hint.startswith(hint))


@pytest.fixture
def tab() -> Tab:
    tab = Tab()
    tab.see()
    return tab


def at(**positions: float) -> tuple[float | None, ...]:
    found = list(state().positions)
    for name, value in positions.items():
        found[number(name)] = value
    return tuple(found)


def test_sliders_follow_joints_without_sending(tab: Tab) -> None:
    assert tab.slider("right_3").value == pytest.approx(-1.2)
    for step in range(20):
        tab.see(positions=at(right_3=-1.2 + 0.1 * step, left_finger=0.002 * step))
        assert tab.queue.due() == [], "what follows is no request"
    assert tab.slider("right_3").value == pytest.approx(0.7)
    assert tab.slider("left_finger").value == pytest.approx(0.038)


def test_moved_slider_sends_target_and_shows_position(tab: Tab) -> None:
    slider = tab.slider("right_3")
    slider.use(ME, value=0.5)
    tab.clock.now += 0.02
    [order] = tab.queue.due()
    assert isinstance(order, MoveJoints)
    assert set(order.targets) == {"right_3"}
    tab.see(0.2, positions=at(right_3=-1.1))
    assert slider.value == 0.5, "it stays where it was put"
    assert slider.label.endswith("(-1.10)"), "and tells where its joint is"
    tab.queue.joints.forget()
    tab.see(2.0, positions=at(right_3=-0.9))
    assert (slider.value, slider.label) == (pytest.approx(-0.9), slider.name)


def test_refused_slider_goes_back(tab: Tab) -> None:
    tab.see(is_enabled=False)
    tab.slider("right_3").use(ME, value=0.5)
    assert tab.queue.due() == []
    tab.see(is_enabled=False)
    assert tab.slider("right_3").value == pytest.approx(-1.2)


def test_sliders_have_limits_and_steps_of_joints(tab: Tab) -> None:
    slider = tab.slider("right_finger")
    assert (slider.min, slider.max, slider.step) == (0.0, 0.04, 0.0001)
    assert tab.slider("right_1").step == 0.005
    tab.see(positions=at(right_finger=-0.001))
    assert slider.value == 0.0, "a joint may be measured a little outside"


def test_gripper_slider_and_buttons_send_closing(tab: Tab) -> None:
    tab.gui.find("slider", "Left closed").use(ME, value=50.0)
    assert tab.queue.due() == [MoveGrippers((0.0, 0.5))]
    tab.clock.now += 5.0
    buttons = [each for each in tab.gui.made if each.kind == "button_group"]
    buttons[0].use(ME, value="Close")
    assert tab.queue.due() == [MoveGrippers((1.0, 0.0))]
    tab.see(5.0, grippers=(0.25, 0.0))
    assert tab.gui.find("slider", "Right closed").value == 25.0
    assert tab.queue.due() == []


def test_stop_home_and_switch_send_their_requests(tab: Tab) -> None:
    tab.gui.find("button", "STOP").use(ME)
    assert tab.stops == 1
    tab.gui.find("button", "Go home").use(ME)
    assert tab.queue.due() == [Ask.HOME]
    switch: Any = tab.gui.find("checkbox", "Accept commands")
    clear: Any = tab.gui.find("button", "Clear emergency stop")
    switch.use(ME, value=False)
    assert tab.queue.due() == [Ask.DISABLE]
    assert not clear.visible
    tab.see(5.0, is_stopped=True, is_enabled=False)
    assert not switch.value
    assert clear.visible
    assert tab.gui.find("button", "Go home").disabled
    tab.see(5.0)
    assert switch.value
    assert tab.queue.due() == [], "what follows is no request"
    clear.use(ME)
    assert tab.queue.due() == [Ask.CLEAR_STOP]


def test_controls_of_disconnected_robot_allow_stop_only(tab: Tab) -> None:
    def live() -> set[str]:
        kinds = {"button", "slider", "checkbox", "button_group"}
        return {each.name for each in tab.gui.made if each.kind in kinds and each.visible and not each.disabled}

    before = live()
    tab.queue.lose()
    tab.controls.show(None, tab.clock.now)
    assert live() == {"STOP", "Handles at the hands", "Along the hand's axes"}
    tab.see()
    assert live() == before


def test_undelivered_stop_notifies_its_browser(tab: Tab) -> None:
    notices: list[str] = []
    client = SimpleNamespace(add_notification=lambda **values: notices.append(values["body"]))
    button = tab.gui.find("button", "STOP")
    button.use(ME, client=client)
    tab.restart_refusal = "the server is away"
    button.use(ME, client=client)
    assert notices == ["the server is away"]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_slider_with_invalid_number_goes_back(tab: Tab, value: float) -> None:
    tab.slider("right_3").use(ME, value=value)
    tab.gui.find("slider", "Left closed").use(ME, value=value)
    assert tab.queue.due() == []
    tab.see()
    assert tab.slider("right_3").value == pytest.approx(-1.2)
    assert tab.gui.find("slider", "Left closed").value == 0.0
    buttons = next(each for each in tab.gui.made if each.kind == "button_group")
    buttons.use(ME, value="Explode")
    assert tab.queue.due() == []


def test_held_base_button_sends_base_command(tab: Tab) -> None:
    button = tab.gui.find("button", "Left")
    assert button.frequency == BUTTON_RATE
    button.use(ME)
    [order] = tab.queue.due()
    assert isinstance(order, MoveBase)


def test_handle_switches_set_handle_options(tab: Tab) -> None:
    tab.gui.find("checkbox", "Handles at the hands").use(ME, value=False)
    tab.gui.find("checkbox", "Along the hand's axes").use(ME, value=True)
    assert (tab.handles.is_shown, tab.handles.along_hand) == (False, True)


def test_controls_of_real_robot_have_stop_only() -> None:
    tab = Tab(is_real=True)
    tab.see(is_stopped=True)
    assert {each.kind for each in tab.gui.made} == {"button", "html"}
    assert any("can only show and stop it" in each.content for each in tab.gui.made if each.kind == "html")
    assert not tab.gui.find("button", "Clear emergency stop").visible
    tab.gui.find("button", "STOP").use(ME)
    assert tab.stops == 1


def test_controls_are_removed(tab: Tab) -> None:
    tab.controls.remove()
    assert tab.gui.find("button", "STOP").is_removed


def test_state_text_is_set_only_on_change(tab: Tab) -> None:
    state = next(each for each in tab.gui.made if each.kind == "html")
    tab.see(commander="/vr")
    before = state.sets
    tab.see(commander="/vr")
    assert state.sets == before
    assert "/vr" in state.content


@pytest.mark.parametrize(
    ("lacks", "state_changes", "name"),
    [
        ({"arms": ()}, {"tips": (), "references": (), "aims": ()}, "Handles at the hands"),
        ({"grippers": ()}, {"grippers": (), "gripper_targets": ()}, "Grippers"),
        ({"base_mode": None}, {}, "Base"),
        ({"groups": ()}, {}, "Right arm"),
    ],
)
def test_controls_of_missing_limbs_are_absent(lacks: dict[str, Any], state_changes: dict[str, Any], name: str) -> None:
    gui, queue = FakeGui(), CommandQueue(replace(seen(), **lacks))
    queue.see(state(**state_changes))
    handles = Handles(FakeScene(), "/scene", queue)
    controls = Controls(gui, nullcontext, queue, handles, lambda: "")
    handles.show(queue.state)
    controls.show(queue.state, 0.0)
    names = {each.name for each in gui.made}
    assert name not in names
    assert "STOP" in names


def test_single_gripper_has_no_side_name() -> None:
    gui = FakeGui()
    queue = CommandQueue(replace(seen(), arms=("",), grippers=("",)))
    Controls(gui, nullcontext, queue, Handles(FakeScene(), "/scene", queue), lambda: "")
    assert gui.find("slider", "Closed").value == 0.0
    assert gui.find("folder", "Gripper").kind == "folder"
