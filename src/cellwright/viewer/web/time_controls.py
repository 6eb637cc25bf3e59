"""Time controls: clock, pause, single steps, speed, reset, and the timeline of a recording."""

import time
from collections import deque
from typing import Any

from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import CONTROL
from cellwright.viewer.web import widgets
from cellwright.viewer.web.page import Feature
from cellwright.viewer.web.widgets import AMBER, BLUE, GREEN, GREY

_SPAN = 2.0  # [s] of wall time that are looked back upon


class SeenPace:
    """Simulated seconds a wall second, over the last two."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()

    def take(self, wall: float, time: float) -> None:
        """Note a simulation time [s] that was told at `wall` [s]."""
        if self._seen and time < self._seen[-1][1]:
            self._seen.clear()  # it has begun anew
        self._seen.append((wall, time))
        while len(self._seen) > 2 and self._seen[0][0] < wall - _SPAN:
            self._seen.popleft()

    @property
    def factor(self) -> float | None:
        """The pace; None as long as it cannot be said."""
        if len(self._seen) < 2:
            return None
        (wall, time), (wall_now, time_now) = self._seen[0], self._seen[-1]
        return (time_now - time) / (wall_now - wall) if wall_now > wall else None


PAUSE, GO_ON, TICK, SECOND = "Pause", "Go on", "Tick", "1 s"
SPEEDS = ("0.1", "0.5", "1", "2", "10", "max")
BEGIN_ANEW, REALLY = "Begin anew", "Click again to begin anew"

_ORDER = -10.0  # above everything but the head of a cell
_SURE = 4.0  # [s] within which one is to click again
_SETTLED = 1.5  # [s] after one has moved the slider before it follows time again


class TimeControls(Feature):
    """The clock, pause, single steps, speed, beginning anew; for recordings also where in time one is."""

    def __init__(self) -> None:
        self._is_up = False
        self._pace = SeenPace()
        self._asked_at = -_SURE
        self._slid_at = -_SETTLED
        self._slider: Any = None
        self._now = 0.0
        self._timestep = 1 / 500

    def begin(self, scene: Scene) -> None:  # noqa: ARG002
        """Put it up, once."""
        told = self.page.link.welcome.get("timestep")
        if isinstance(told, list) and len(told) == 2:
            self._timestep = told[0] / told[1]
        if self._is_up:
            return
        self._is_up, gui = True, self.page.server.gui
        self._clock = gui.add_html("", order=_ORDER)
        self._steps = gui.add_button_group(
            "time", (PAUSE, GO_ON, TICK, SECOND), order=_ORDER + 1, hint="Let time stand, pass, or pass for so long"
        )
        self._speeds = gui.add_button_group(
            "speed", SPEEDS, order=_ORDER + 2, hint="Simulated seconds a second; max: as fast as it goes"
        )
        self._anew = gui.add_button(BEGIN_ANEW, order=_ORDER + 3, color="gray", visible=False)
        self._steps.on_click(lambda event: self._step(str(event.target.value)))
        self._speeds.on_click(lambda event: self._set_speed(str(event.target.value)))
        self._anew.on_click(lambda _: self._begin_anew())

    def panel(self, panel: dict[str, Any]) -> None:
        """Show how time passes."""
        control = panel.get("control")
        if not self._is_up or control is None:
            return
        try:
            now = seconds_of(panel)
        except (KeyError, TypeError, ValueError):  # it was told by another version
            return
        self._now = now
        self._pace.take(time.perf_counter(), now)
        self._clock.content = clock(now, control, self._pace.factor)
        reasons = control["refused"]
        for group, action in ((self._steps, "pause"), (self._speeds, "speed")):
            group.visible = not reasons.get(action)  # viser disables no group of buttons
        self._show_reset(panel, str(reasons.get("reset", "")))
        self._show_timeline(panel, now)

    def away(self, reason: str) -> None:
        """Nobody answers: show the time that was told last, and offer nothing."""
        if not self._is_up:
            return
        self._clock.content = _standing(self._now, "not connected", reason)
        for handle in (self._steps, self._speeds, self._anew, self._slider):
            if handle is not None:
                handle.visible = False

    def _show_reset(self, panel: dict[str, Any], reason: str) -> None:
        button = self._anew
        is_sure = time.perf_counter() - self._asked_at < _SURE
        button.label = REALLY if is_sure else BEGIN_ANEW
        button.color = "red" if is_sure else "gray"
        button.visible = panel.get("kind") != "robot"  # whose own controls send it home
        button.disabled = bool(reason)
        button.hint = reason or "Back to the start: what has happened is gone"

    def _show_timeline(self, panel: dict[str, Any], now: float) -> None:
        begin, end = panel.get("begin"), panel.get("end")
        if begin is None or end is None:
            if self._slider is not None:
                self._slider.visible = False
            return
        last = max(end, begin + 0.1)
        if self._slider is None:
            self._slider = self.page.server.gui.add_slider(
                "at [s]", min=begin, max=last, step=0.1, initial_value=begin, order=_ORDER + 0.5
            )
            self._slider.on_update(self._seek)
        self._slider.visible = True
        self._slider.min, self._slider.max = begin, last  # what is served there may have become another recording
        if time.perf_counter() - self._slid_at > _SETTLED:
            # viser sends only what is new: the same value again would undo what a viewer has just moved
            self._slider.value = round(min(max(now, begin), end), 1)

    def _step(self, word: str) -> None:
        if word == PAUSE:
            self._ask(action="pause")
        elif word == GO_ON:
            self._ask(action="resume")
        else:
            self._ask(action="step", ticks=1 if word == TICK else max(1, round(1.0 / self._timestep)))

    def _set_speed(self, word: str) -> None:
        self._ask(action="speed", factor="max" if word == "max" else float(word))

    def _begin_anew(self) -> None:
        now = time.perf_counter()
        if now - self._asked_at < _SURE:
            self._asked_at = -_SURE
            self._ask(action="reset")
        else:
            self._asked_at = now
            self._anew.label = REALLY

    def _seek(self, event: Any) -> None:
        if event.client is not None:  # not when it follows time
            self._slid_at = time.perf_counter()
            self._ask(action="seek", time=float(event.target.value))

    def _ask(self, **asked: Any) -> None:
        try:
            self.page.link.ask(CONTROL, **asked)
        except CellwrightError as error:
            self.page.tell(f"{asked['action']}: refused", str(error), is_bad=True)


def seconds_of(panel: dict[str, Any]) -> float:
    """The simulation time [s] that a panel tells."""
    if "clock" in panel:
        return float(panel["clock"]["time"])
    told = panel.get("time", 0)
    return told / 1e9 if panel.get("kind") == "robot" else float(told)


def clock(now: float, control: dict[str, Any], pace: float | None) -> str:
    """The clock as HTML, of a simulation time [s] and how time passes, as it is told and at the pace seen."""
    if control.get("over"):
        return _standing(now, "over", f"{control['over']}: all is shown as it stood at the end")
    if control["paused"]:
        label = widgets.chip("a step" if control["ticks_left"] else "paused", AMBER)
    elif control["lockstep"]:
        label = widgets.chip("lockstep", BLUE)
    else:
        label = widgets.chip("running", GREEN)
    asked = "as fast as it goes" if control["speed"] == "max" else f"asked {control['speed']:g} ×"
    seen = "" if pace is None or control["paused"] else f"{pace:.1f} × real time, "
    return widgets.block(
        widgets.row(widgets.big(f"{now:.2f}", "s"), label, "align-items:center"), widgets.figures(f"{seen}{asked}")
    )


def _standing(now: float, state: str, reason: str) -> str:
    """The clock as HTML when no time passes any more."""
    row = widgets.row(widgets.big(f"{now:.2f}", "s"), widgets.chip(state, GREY), "align-items:center")
    return widgets.block(row, widgets.dim(reason))
