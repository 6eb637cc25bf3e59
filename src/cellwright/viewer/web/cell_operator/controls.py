"""Tab of the operator on a cell's page: stop, state, aids, gripper, kits and joints."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from cellwright.clients.agents.operator.requests import JOINTS, joints_request
from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, VacuumGripperControlRequest
from cellwright.viewer.web import widgets
from cellwright.viewer.web.cell_operator.arms import OperatorState
from cellwright.viewer.web.cell_operator.sender import Sender
from cellwright.viewer.web.input import KEYS_HTML, MARK
from cellwright.viewer.web.widgets import AMBER, GREEN, GREY, RED

HOME, HOLD, SNAP = "Home", "Hold", "Snap"
ARM_ACTIONS = {HOME: "home", HOLD: "hold", SNAP: "snap"}
"""Buttons of an arm, with their commands."""
UPRIGHT, BELT = "Tool upright", "Meet the belt's speed"
GRIP, RELEASE = "Grip", "Release"
NO_KIT = "(none)"

_TOP = -30.0  # above all else on the page
_TOUCHED = 1.0  # [s] for which a slider or a box keeps its new value, until the agent has it
_STEP = 0.001  # [rad; m] of a slider
_TURN, _SLIDE = 6.283, 10.0  # [rad], [m]: ends of a joint without limits


def state_html(state: OperatorState | None, note: str) -> str:
    """State of the agent and the newest note as HTML."""
    if state is None:
        return widgets.block(widgets.chip("no operator", GREY))
    arm = state.arms.get(state.arm)
    if state.is_stopped:
        chip = widgets.chip("STOPPED", RED)
    elif arm is None or arm.mode == "idle":
        chip = widgets.chip("idle", GREY)
    else:
        chip = widgets.chip(arm.mode, AMBER if arm.why else GREEN)
    parts = [f"{MARK}{chip} {widgets.text(state.arm)}"]
    if arm is not None and arm.why:
        parts.append(widgets.dim(arm.why))
    if not state.has_begun:
        parts.append(widgets.dim("The competition begins with your first motion."))
    parts += [f'<div style="font-weight:600">{widgets.text(each)}</div>' for each in (state.note, note) if each]
    return widgets.block(*parts, style="overflow-wrap:anywhere")


class CellControls:
    """Controls of the operator.

    Args:
        gui: viser's GUI.
        tab: opens the tab.
        arms: the arms, by name.
        senders: services that send kits off, by their labels.
        sender: sends the requests.
    """

    def __init__(
        self,
        gui: Any,
        tab: Callable[[], AbstractContextManager[Any]],
        arms: Mapping[str, OperatedArm],
        senders: Mapping[str, str],
        sender: Sender,
    ) -> None:
        self._gui, self._arms, self._senders, self._sender = gui, arms, senders, sender
        self._touched: dict[str, float] = {}
        self._made: list[Any] = []
        self._shown_arm = ""
        self._joints: list[tuple[str, int, Any]] = []
        self._folder: Any = None
        self._build_head()
        with tab():
            self._build()
        self._tab = tab

    def remove(self) -> None:
        """Remove all controls."""
        for each in self._made:
            each.remove()

    def show(self, state: OperatorState | None, kits: Sequence[str], note: str) -> None:
        """Show what the agent has reported, the kits that may be sent, and a note."""
        self._state.content = state_html(state, note)
        self._clear.visible = state is not None and state.is_stopped
        names = tuple(kits) or (NO_KIT,)
        if tuple(self._kit.options) != names:
            self._kit.options = names
        arm = None if state is None else state.arms.get(state.arm)
        if state is None or arm is None or state.arm not in self._arms:
            return
        if self._shown_arm != state.arm:
            self._show_joints(state.arm)
        self._follow("arm", self._chosen, state.arm)
        self._follow(UPRIGHT, self._upright, arm.is_upright)
        self._follow(BELT, self._belt, arm.meets_belt)
        for name, number, slider in self._joints:
            if number < len(arm.joints):
                value = min(max(arm.joints[number], slider.min), slider.max)
                if abs(value - slider.value) > _STEP:
                    self._follow(name, slider, value)

    def grip(self, *, enable: bool) -> None:
        """Close the gripper of the chosen arm, or switch its suction on; or release."""
        arm = self._arms[self._shown_arm].arm if self._shown_arm else None
        if arm is not None and arm.tool.kind != "none":
            space = f"/ariac/{arm.namespace}" if arm.namespace else "/ariac"
            self._sender.call(f"{space}/gripper/control", VacuumGripperControlRequest(enable=enable))

    def _build_head(self) -> None:
        gui = self._gui
        stop = self._keep(gui.add_button("STOP", color="red", icon="hand-stop", order=_TOP, hint="All arms hold"))
        stop.on_click(lambda _event: self._sender.command("stop"))
        self._state = self._keep(gui.add_html("", order=_TOP + 1))
        self._clear = self._keep(gui.add_button("Clear stop", icon="lock-open", visible=False, order=_TOP + 2))
        self._clear.on_click(lambda _event: self._sender.command("clear"))

    def _build(self) -> None:
        gui, sender = self._gui, self._sender
        names = tuple(self._arms)
        self._chosen = self._keep(gui.add_dropdown("arm", names, visible=len(names) > 1))
        self._chosen.on_update(lambda event: self._ask(event, "arm", f"arm {event.target.value}"))
        actions = self._keep(gui.add_button_group("arm", tuple(ARM_ACTIONS)))
        actions.on_click(lambda event: sender.command(ARM_ACTIONS[str(event.target.value)]))
        hint = "The tool points straight down; a ring turns it about the vertical"
        self._upright = self._keep(gui.add_checkbox(UPRIGHT, initial_value=False, hint=hint))
        self._upright.on_update(lambda event: self._switch(event, UPRIGHT, "upright"))
        hint = "Over a belt, the tool moves with it"
        self._belt = self._keep(gui.add_checkbox(BELT, initial_value=False, hint=hint))
        self._belt.on_update(lambda event: self._switch(event, BELT, "belt"))
        grip = self._keep(gui.add_button_group("gripper", (GRIP, RELEASE)))
        grip.on_click(lambda event: self.grip(enable=event.target.value == GRIP))
        self._kit = self._keep(gui.add_dropdown("kit", (NO_KIT,)))
        if self._senders:
            send = self._keep(gui.add_button_group("send off", tuple(self._senders)))
            send.on_click(lambda event: self._send_off(str(event.target.value)))
        self._keep(gui.add_html(KEYS_HTML))

    def _show_joints(self, arm: str) -> None:
        """Make the sliders of another arm."""
        if self._folder is not None:
            self._folder.remove()
        self._shown_arm, self._joints = arm, []
        operated = self._arms[arm]
        with self._tab():
            self._folder = self._gui.add_folder("Joints", expand_by_default=False)
        with self._folder:
            for number, (name, (lower, upper, _)) in enumerate(zip(operated.joints, operated.limits, strict=True)):
                end = _SLIDE if operated.has_rail and number == 0 else _TURN
                low, high = max(lower, -end), min(upper, end)
                slider = self._gui.add_slider(
                    name, min=low, max=high, step=_STEP, initial_value=min(max(0.0, low), high)
                )
                slider.on_update(self._slide(name))
                self._joints.append((name, number, slider))

    def _slide(self, name: str) -> Callable[[Any], None]:
        def slide(event: Any) -> None:
            if event.client_id is not None:  # not when it follows its joint
                self._touched[name] = time.perf_counter()
                self._sender.put(JOINTS, joints_request({name: float(event.target.value)}))

        return slide

    def _ask(self, event: Any, name: str, command: str) -> None:
        if event.client_id is not None:
            self._touched[name] = time.perf_counter()
            self._sender.command(command)

    def _switch(self, event: Any, name: str, command: str) -> None:
        self._ask(event, name, f"{command} {'on' if event.target.value else 'off'}")

    def _send_off(self, label: str) -> None:
        kit = str(self._kit.value)
        self._sender.call(self._senders[label], AGVControlRequest(kit_type="" if kit == NO_KIT else kit))

    def _follow(self, name: str, handle: Any, value: Any) -> None:
        """Show a value, unless a browser has just set another one."""
        if time.perf_counter() - self._touched.get(name, float("-inf")) > _TOUCHED and handle.value != value:
            handle.value = value

    def _keep(self, handle: Any) -> Any:
        self._made.append(handle)
        return handle
