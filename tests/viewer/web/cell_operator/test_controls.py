"""Controls of the operator of a cell."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import pytest

from cellwright.clients.agents.operator.requests import JOINTS
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, VacuumGripperControlRequest
from cellwright.viewer.web.cell_operator.controls import (
    ARM_ACTIONS,
    BELT,
    GRIP,
    NO_KIT,
    RELEASE,
    UPRIGHT,
    CellControls,
    state_html,
)
from cellwright.viewer.web.input import MARK
from tests.support.cells import INITIAL
from tests.viewer.web.cell_operator.fakes import KeepingSender, arms, state
from tests.viewer.web.operator.fakes import FakeGui

ME = 3


@pytest.fixture
def gui() -> FakeGui:
    return FakeGui()


@pytest.fixture
def sender() -> KeepingSender:
    return KeepingSender()


@pytest.fixture
def controls(gui: FakeGui, sender: KeepingSender) -> CellControls:
    controls = CellControls(gui, nullcontext, arms(), {"agv1": "/ariac/agv1"}, sender)
    controls.show(state(), ["order_0_kit_0"], "")
    return controls


@pytest.mark.usefixtures("controls")
def test_buttons_send_commands(gui: FakeGui, sender: KeepingSender) -> None:
    gui.find("button", "STOP").use(ME)
    gui.find("button", "Clear stop").use(ME)
    for label in ARM_ACTIONS:
        gui.find("button_group", "arm").use(ME, value=label)
    assert sender.given == [("command", each) for each in ("stop", "clear", *ARM_ACTIONS.values())]


@pytest.mark.usefixtures("controls")
def test_boxes_switch_the_aids_of_a_browser_alone(gui: FakeGui, sender: KeepingSender) -> None:
    gui.find("checkbox", UPRIGHT).use(ME, value=False)
    gui.find("checkbox", BELT).use(ME, value=True)
    gui.find("checkbox", BELT).use(None, value=False)
    assert sender.given == [("command", "upright off"), ("command", "belt on")]


@pytest.mark.usefixtures("controls")
def test_gripper_and_kits_go_to_the_services_of_all_programs(gui: FakeGui, sender: KeepingSender) -> None:
    for label in (GRIP, RELEASE):
        gui.find("button_group", "gripper").use(ME, value=label)
    kit = gui.find("dropdown", "kit")
    assert tuple(kit.options) == ("order_0_kit_0",)
    kit.use(ME, value="order_0_kit_0")
    gui.find("button_group", "send off").use(ME, value="agv1")
    assert sender.given == [
        ("/ariac/gripper/control", VacuumGripperControlRequest(enable=True)),
        ("/ariac/gripper/control", VacuumGripperControlRequest(enable=False)),
        ("/ariac/agv1", AGVControlRequest(kit_type="order_0_kit_0")),
    ]


def test_no_kit_is_sent_as_none(gui: FakeGui, sender: KeepingSender, controls: CellControls) -> None:
    controls.show(state(), [], "")
    gui.find("dropdown", "kit").use(ME, value=NO_KIT)
    gui.find("button_group", "send off").use(ME, value="agv1")
    assert sender.given == [("/ariac/agv1", AGVControlRequest(kit_type=""))]


def test_sliders_show_the_joints_and_move_them(gui: FakeGui, sender: KeepingSender, controls: CellControls) -> None:
    rail = gui.find("slider", "linear_arm_actuator_joint")
    assert (rail.min, rail.max) == (-2.1, 2.1)
    assert gui.find("slider", "wrist_1_joint").value == pytest.approx(INITIAL[4])
    assert sender.given == [], "a slider that follows its joint moves nothing"
    rail.use(ME, value=1.0)
    ((topic, message),) = sender.given
    assert (topic, message.name, list(message.position)) == (JOINTS, ["linear_arm_actuator_joint"], [1.0])
    controls.show(state(), [], "")
    assert rail.value == 1.0, "it keeps its new value meanwhile"


def test_stop_offers_to_clear_it(gui: FakeGui, controls: CellControls) -> None:
    clear = gui.find("button", "Clear stop")
    assert not clear.visible
    controls.show(state(stopped=True), [], "")
    assert clear.visible


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ["idle", "arm"]),
        ({"mode": "blocked", "why": "out of reach"}, ["blocked", "out of reach"]),
        ({"stopped": True}, ["STOPPED"]),
        ({"begun": False}, ["begins with your first motion"]),
        ({"note": "snap: <gear>"}, ["snap: &lt;gear&gt;"]),
    ],
)
def test_state_is_shown_in_words(changes: dict[str, Any], words: list[str]) -> None:
    text = state_html(state(**changes), "")
    assert all(word in text for word in words)
    assert MARK in text
    assert "refused" in state_html(state(**changes), "refused")


def test_controls_go_when_they_are_removed(gui: FakeGui, controls: CellControls) -> None:
    controls.remove()
    assert all(each.is_removed for each in gui.made if each.kind not in ("folder", "slider"))
    assert MARK not in state_html(None, "")
