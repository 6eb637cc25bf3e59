"""Time control by clients, and refusal of nonsense."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.util.errors import CellwrightError, RejectedCommandError, UnknownNameError
from cellwright.viewer.services.control import MAX_SPEED, MAX_TICKS, MIN_SPEED, Control, Reset, offer_panel
from cellwright.viewer.services.names import CONTROL, PANEL
from tests.middleware.server.talk import served
from tests.robot.talk import Talk


def control(rate_control: RateControl | None = None, **more: Any) -> Control:
    return Control(rate_control or RateControl(1.0), **more)


def test_control_pauses_steps_and_resumes() -> None:
    controller = control()
    assert controller.control({"action": "pause"})["paused"]
    state = controller.control({"action": "step", "ticks": 7})
    assert (state["paused"], state["ticks_left"]) == (True, 7)
    assert controller.control({"action": "step"})["ticks_left"] == 8
    assert not controller.control({"action": "resume"})["paused"]


@pytest.mark.parametrize(
    ("factor", "speed"), [(0.1, 0.1), (5, 5.0), ("max", None), (MIN_SPEED, 0.01), (MAX_SPEED, 1000.0)]
)
def test_control_accepts_valid_speed(factor: Any, speed: float | None) -> None:
    controller = control()
    assert controller.control({"action": "speed", "factor": factor})["speed"] == factor
    assert controller.rate_control.speed == speed


@pytest.mark.parametrize("factor", [0, -1, 1e9, float("nan"), float("inf"), True, None, "fast", [1], {}])
def test_control_refuses_invalid_speed(factor: Any) -> None:
    controller = control()
    with pytest.raises(RejectedCommandError, match="factor"):
        controller.control({"action": "speed", "factor": factor})
    assert controller.rate_control.speed == 1.0


@pytest.mark.parametrize("ticks", [0, -3, 1.5, MAX_TICKS + 1, True, "all", None])
def test_control_refuses_invalid_ticks(ticks: Any) -> None:
    controller = control()
    with pytest.raises(RejectedCommandError, match="ticks"):
        controller.control({"action": "step", "ticks": ticks})
    assert not controller.rate_control.is_paused


def test_control_after_run_refuses_all_but_reset() -> None:
    controller = control(reset=Reset(lambda: None))
    assert controller.state()["over"] == ""
    controller.over = "the run is over"
    for action in ("pause", "resume", "step", "speed"):
        with pytest.raises(RejectedCommandError, match="the run is over"):
            controller.control({"action": action})
    assert controller.control({"action": "state"})["over"] == "the run is over"
    assert controller.control({"action": "reset"})["resets"] == 1


@given(st.dictionaries(st.sampled_from(["action", "ticks", "factor", "x"]), st.none() | st.text() | st.integers()))
def test_unknown_action_is_refused_without_effect(message: dict[str, Any]) -> None:
    controller = control()
    if message.get("action") not in ("pause", "resume", "step", "speed", "reset", "state"):
        with pytest.raises(UnknownNameError, match="action"):
            controller.control(message)
        assert not controller.rate_control.is_paused


def test_refused_reset_has_reason() -> None:
    controller = control()
    assert "reset" in controller.state()["refused"]
    with pytest.raises(RejectedCommandError, match="restart is not available"):
        controller.control({"action": "reset"})
    assert controller.state()["resets"] == 0


def test_reset_is_counted() -> None:
    done: list[bool] = []
    controller = control(reset=Reset(lambda: done.append(True)))
    before = controller.rate_control.changes
    assert controller.control({"action": "reset"})["resets"] == 1
    assert done == [True]
    assert controller.rate_control.changes > before


def test_reset_of_state_has_its_own_refusal() -> None:
    done: list[str] = []
    refusal = ["not now"]
    whole = Reset(lambda: done.append("whole"))
    alone = control(reset=whole)
    assert "reset" not in alone.state()["refused"]
    with pytest.raises(RejectedCommandError, match="use reset"):
        alone.control({"action": "reset_state"})
    both = control(reset=replace(whole, act_on_state=lambda: done.append("state"), state_refusal=lambda: refusal[0]))
    with pytest.raises(RejectedCommandError, match="not now"):
        both.control({"action": "reset_state"})
    refusal[0] = ""
    assert both.control({"action": "reset_state"})["resets"] == 1
    assert done == ["state"]


@pytest.mark.parametrize("action", ["pause", "resume", "step", "speed"])
def test_control_of_real_robot_refuses_time_actions(action: str) -> None:
    controller = control(refused={action: "a real robot keeps real time"})
    with pytest.raises(RejectedCommandError, match="real robot"):
        controller.control({"action": action, "factor": 2})
    assert controller.state()["refused"][action] == "a real robot keeps real time"


def test_control_over_server_refuses_with_reason_and_panel_has_state() -> None:
    talk, rate_control = Talk(), RateControl(1.0)
    with served(talk.node) as hall:
        offer_panel(hall.server, lambda request: {"kind": "robot", "asked": request}, Control(rate_control))
        client = hall.connect()

        def ask(service: str, **request: Any) -> Frame:
            return client.ask(Frame(FrameKind.CALL, 3, service, payload=json.dumps(request).encode()))

        assert ask(CONTROL, action="pause").json()["paused"]
        refused = ask(CONTROL, action="sleep")
        assert refused.kind is FrameKind.REFUSED
        assert issubclass(UnknownNameError, CellwrightError)
        assert b"pause" in refused.payload
        panel = ask(PANEL, robot="x").json()
        assert panel["asked"] == {"robot": "x"}
        assert panel["control"]["paused"]
