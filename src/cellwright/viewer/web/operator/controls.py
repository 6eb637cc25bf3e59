"""What a robot is driven with: stop and state above all else; in a tab grippers, joints, and the base's buttons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from cellwright.operators.orders import Ask
from cellwright.teleop.base import Mode
from cellwright.viewer.web.operator import drive
from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.handles import Handles
from cellwright.viewer.web.operator.robot import SeenGroup, SeenJoint, Standing
from cellwright.viewer.web.operator.state_text import state_html

_TOP = -30.0  # above all else on the page
_FOLLOWS = 0.12  # [s] between two looks at where sliders should stand
_STEPS = (0.0001, 0.0005, 0.001, 0.005, 0.01)  # of sliders [rad; m]
_FINENESS = 500  # steps from end to end, at least
_ASKED = 1.5  # [s] for which a switch stands as it was put, until the robot has done it
_OPEN, _CLOSE = "Open", "Close"


@dataclass(slots=True)
class _Slider:
    """A slider of a joint, and its name when its joint is where it stands."""

    joint: int
    handle: Any
    name: str


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
        self._sliders: list[_Slider] = []
        self._grips: list[Any] = []
        self._html = ""
        self._enabled: Any = None
        self._home: Any = None
        self._build_head(stop)
        if not desk.robot.is_real:
            with tab():
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
        self._state = self._keep(gui.add_html("", order=_TOP + 1))
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
        if robot.arms:
            self._build_switches()
        if robot.grippers:
            self._build_grips(robot.grippers)
        for group in robot.groups:
            with self._keep(gui.add_folder(group.name.capitalize(), expand_by_default=False)):
                self._build_group(group)
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

    def _build_grips(self, names: Sequence[str]) -> None:
        gui, desk = self._gui, self._desk
        with self._keep(gui.add_folder("Grippers" if len(names) > 1 else "Gripper")):
            for number, name in enumerate(names):
                slider = gui.add_slider(
                    f"{name} closed".strip().capitalize(), min=0.0, max=100.0, step=1.0, initial_value=0.0, hint="%"
                )

                async def close(event: Any, number: int = number) -> None:
                    if event.client_id is not None:
                        desk.grip(number, float(event.target.value) / 100.0)

                slider.on_update(close)
                self._grips.append(slider)
                both = gui.add_button_group("", (_OPEN, _CLOSE))

                async def press(event: Any, number: int = number) -> None:
                    if event.target.value in (_OPEN, _CLOSE):
                        desk.grip(number, float(event.target.value == _CLOSE))

                both.on_click(press)

    def _build_group(self, group: SeenGroup) -> None:
        desk, robot = self._desk, self._desk.robot
        joints = [robot.joints[number] for number in group.joints]
        for number, seen, name in zip(group.joints, joints, short_names([each.name for each in joints]), strict=True):
            if seen.upper <= seen.lower:
                continue  # it cannot be moved
            slider = self._gui.add_slider(
                name,
                min=seen.lower,
                max=seen.upper,
                step=step_of(seen),
                initial_value=robot.clamped(number, 0.0),
                hint=f"{seen.name}: {seen.lower:.4g} to {seen.upper:.4g} {seen.unit}",
            )

            async def slide(event: Any, number: int = number) -> None:
                if event.client_id is not None:  # else it was put where its joint is
                    desk.slide(number, float(event.target.value))

            slider.on_update(slide)
            self._sliders.append(_Slider(number, slider, name))

    def _build_base(self, mode: Mode) -> None:
        desk = self._desk
        for direction in drive.directions(mode):
            button = self._gui.add_button(direction.capitalize(), hint="As long as it is held")

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
        """Show how the robot stands at `now` [s]."""
        self._now = now
        if now - self._followed < _FOLLOWS:
            return
        self._followed = now
        html = state_html(self._desk, now)
        if html != self._html:
            self._html = self._state.content = html
        if standing is None:
            return
        _set(self._clear, "visible", standing.is_stopped and not self._desk.robot.is_real)
        if self._enabled is not None and now - self._switched > _ASKED:
            _set(self._enabled, "value", standing.is_enabled)
        if self._home is not None:
            _set(self._home, "disabled", bool(standing.why_not))
        for number, slider in enumerate(self._grips):
            if not self._desk.grips.is_touched(number, now):
                _set(slider, "value", float(round(100.0 * standing.grippers[number])))
        for each in self._sliders:
            self._follow(each, standing, now)

    def _follow(self, slider: _Slider, standing: Standing, now: float) -> None:
        """Put a slider where its joint is; one that somebody has just moved tells that in its name."""
        measured = standing.positions[slider.joint]
        if measured is None:
            return
        handle, seen = slider.handle, self._desk.robot.joints[slider.joint]
        place = min(max(measured, seen.lower), seen.upper)
        is_off = not abs(handle.value - place) <= step_of(seen)  # also where a browser has sent what is no number
        if not self._desk.joints.is_touched(slider.joint, now):
            _set(handle, "label", slider.name)
            if is_off:
                handle.value = place
        else:
            _set(handle, "label", f"{slider.name} ({measured:.2f})" if is_off else slider.name)


def step_of(joint: SeenJoint) -> float:
    """The step of a joint's slider [rad; m]: a round number, and fine enough."""
    wanted = (joint.upper - joint.lower) / _FINENESS
    return max([step for step in _STEPS if step <= wanted], default=_STEPS[0])


def short_names(names: Sequence[str]) -> list[str]:
    """Names without the words that all of them begin with: there is little room beside a slider."""
    if len(names) < 2:
        return list(names)
    words = [name.split("_") for name in names]
    common = 0
    while all(len(each) > common + 1 and each[common] == words[0][common] for each in words):
        common += 1
    return ["_".join(each[common:]) for each in words]


def _set(handle: Any, attribute: str, value: Any) -> None:
    """Set something of a handle unless it is so: what does not change is not sent."""
    if getattr(handle, attribute) != value:
        setattr(handle, attribute, value)
