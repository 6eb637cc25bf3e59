"""What a robot is driven with: stop and state above all else; in a tab grippers, joints, and the base's buttons."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from cellwright.clients.operators.orders import Ask
from cellwright.robot.base import Mode
from cellwright.viewer.web import html
from cellwright.viewer.web.operator import drive
from cellwright.viewer.web.operator.desk import READ_ONLY, Desk
from cellwright.viewer.web.operator.handles import Handles
from cellwright.viewer.web.operator.robot import Standing
from cellwright.viewer.web.operator.sliders import Sliders
from cellwright.viewer.web.operator.state_text import state_html
from cellwright.viewer.web.shown import Shown, set_changed

_TOP = -30.0  # above all else on the page
_FOLLOWS = 0.12  # [s] between two looks at where sliders should stand
_ASKED = 1.5  # [s] for which a switch stands as it was put, until the robot has done it


class Controls:
    """The tab.

    Args:
        gui: viser's: what must always be at hand (stop, state) goes to the top of it.
        tab: opens the tab, for the rest.
        desk: where it is told what somebody does.
        handles: those of the hands, which have their switches here.
        stop: does an emergency stop, at once; says what stands in its way, or nothing.
    """

    def __init__(
        self,
        gui: Any,
        tab: Callable[[], AbstractContextManager[Any]],
        desk: Desk,
        handles: Handles,
        stop: Callable[[], str],
    ) -> None:
        self._gui, self._desk, self._all_handles = gui, desk, handles
        self._switched = self._followed = self._now = float("-inf")
        self._made: list[Any] = []
        self._buttons: list[Any] = []  # those that do nothing while the robot is not heard from
        self._sliders = Sliders(gui, desk)
        self._enabled: Any = None
        self._home: Any = None
        self._build_head(stop)
        with tab():
            if desk.robot.is_real:
                said = html.block(html.dim(f"{READ_ONLY[0].upper()}{READ_ONLY[1:]}."))
                self._keep(gui.add_html(said))
            else:
                self._build()

    def remove(self) -> None:
        """Take all of it away."""
        for each in self._made:
            each.remove()

    # ---------------------------------------------------------------- what is built

    def _build_head(self, stop: Callable[[], str]) -> None:
        gui, desk = self._gui, self._desk
        button = self._keep(
            gui.add_button(
                "STOP", color="red", icon="hand-stop", order=_TOP, hint="Emergency stop: the robot holds at once"
            )
        )

        def press(event: Any) -> None:  # in a thread of viser's: it waits for nobody
            hindrance = stop()
            if hindrance and event.client is not None:
                event.client.add_notification(title="Not stopped yet", body=hindrance, color="red")

        button.on_click(press)
        self._state = self._keep(Shown(gui, _TOP + 1))
        self._clear = self._keep(
            gui.add_button(
                "End the emergency stop",
                icon="lock-open",
                visible=False,
                order=_TOP + 2,
                hint="The robot stays where it is until the next command",
            )
        )
        self._clear.on_click(lambda _event: desk.ask(Ask.CLEAR_STOP))
        self._buttons.append(self._clear)

    def _build(self) -> None:
        gui, desk, robot = self._gui, self._desk, self._desk.robot
        self._enabled = self._keep(
            gui.add_checkbox("Takes commands", initial_value=True, hint="Off: the robot holds, whoever commands")
        )
        self._enabled.on_update(self._switch)
        self._home = self._keep(
            gui.add_button("Go home", icon="home", hint="Arms, waist and head go to where they start, grippers open")
        )
        self._home.on_click(lambda _event: desk.ask(Ask.HOME))
        self._buttons.append(self._enabled)
        if robot.arms:
            self._build_switches()
        if robot.grippers:
            with self._keep(gui.add_folder("Grippers" if len(robot.grippers) > 1 else "Gripper")):
                self._sliders.add_grips(robot.grippers)
        for group in robot.groups:
            with self._keep(gui.add_folder(group.name.capitalize(), expand_by_default=False)):
                self._sliders.add_joints(group)
        if robot.base_mode is not None:
            with self._keep(gui.add_folder("Base", expand_by_default=False)):
                self._build_base(Mode(robot.base_mode))

    def _build_switches(self) -> None:
        handles, gui = self._all_handles, self._gui
        shown = self._keep(gui.add_checkbox("Handles at the hands", initial_value=True))
        along = self._keep(
            gui.add_checkbox(
                "Along the hand's axes",
                initial_value=False,
                hint="Handles move along the hand's own axes, not the world's",
            )
        )

        async def switch(_event: Any) -> None:
            handles.is_shown, handles.along_hand = bool(shown.value), bool(along.value)

        shown.on_update(switch)
        along.on_update(switch)

    def _build_base(self, mode: Mode) -> None:
        desk = self._desk
        for direction in drive.directions(mode):
            button = self._gui.add_button(direction.capitalize(), hint="As long as it is held")
            self._buttons.append(button)

            async def push(_event: Any, direction: str = direction) -> None:
                desk.drive(direction)

            button.on_hold(push, callback_hz=drive.RATE)

    async def _switch(self, event: Any) -> None:
        if event.client_id is not None:
            self._switched = self._now
            self._desk.ask(Ask.ENABLE if event.target.value else Ask.DISABLE)

    def _keep(self, handle: Any) -> Any:
        self._made.append(handle)
        return handle

    # ---------------------------------------------------------------- what is shown

    def show(self, standing: Standing | None, now: float) -> None:
        """Show how the robot stands at `now` [s]; without that, offer nothing but the stop."""
        self._now = now
        if standing is not None and now - self._followed < _FOLLOWS:
            return
        self._followed = now
        self._state.show(state_html(self._desk, now))
        for handle in self._buttons:
            set_changed(handle, "disabled", standing is None)
        if self._home is not None:
            set_changed(self._home, "disabled", standing is None or bool(standing.why_not))
        self._sliders.allow(is_allowed=standing is not None)
        if standing is None:
            return
        set_changed(self._clear, "visible", standing.is_stopped and not self._desk.robot.is_real)
        if self._enabled is not None and now - self._switched > _ASKED:
            set_changed(self._enabled, "value", standing.is_enabled)
        self._sliders.show(standing, now)
