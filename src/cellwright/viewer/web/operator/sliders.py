"""Sliders for joints and grippers: they follow what they stand for, unless somebody has just moved them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.robot import SeenGroup, SeenJoint, Standing
from cellwright.viewer.web.shown import set_changed

_STEPS = (0.0001, 0.0005, 0.001, 0.005, 0.01)  # of sliders [rad; m]
_FINENESS = 500  # steps from end to end, at least
_OPEN, _CLOSE = "Open", "Close"


@dataclass(slots=True)
class _Slider:
    """A slider of a joint, and its name when its joint is where it stands."""

    joint: int
    handle: Any
    name: str


class Sliders:
    """All that a robot has.

    Args:
        gui: viser's.
        desk: where it is told what somebody does.
    """

    def __init__(self, gui: Any, desk: Desk) -> None:
        self._gui, self._desk = gui, desk
        self._joints: list[_Slider] = []
        self._grips: list[Any] = []
        self._both: list[Any] = []

    def add_grips(self, names: Sequence[str]) -> None:
        """One for each gripper, with buttons for open and closed."""
        gui, desk = self._gui, self._desk
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
            self._both.append(both)

    def add_joints(self, group: SeenGroup) -> None:
        """One for each joint of a group that can be moved."""
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
            self._joints.append(_Slider(number, slider, name))

    def allow(self, *, is_allowed: bool) -> None:
        """Let one move them, or not."""
        for handle in (*self._grips, *(each.handle for each in self._joints)):
            set_changed(handle, "disabled", not is_allowed)
        for group in self._both:
            set_changed(group, "visible", is_allowed)  # viser disables no group of buttons

    def show(self, standing: Standing, now: float) -> None:
        """Put them where the robot stands at `now` [s]."""
        for number, slider in enumerate(self._grips):
            if not self._desk.grips.is_touched(number, now):
                set_changed(slider, "value", float(round(100.0 * standing.grippers[number])))
        for each in self._joints:
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
            set_changed(handle, "label", slider.name)
            if is_off:
                handle.value = place
        else:
            set_changed(handle, "label", f"{slider.name} ({measured:.2f})" if is_off else slider.name)


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
