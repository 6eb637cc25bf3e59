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

_SPAN = 2.0  # [s] of wall time to average over
PAUSE, RESUME, STEP, SECOND = "Pause", "Resume", "Step", "1 s"
SPEEDS = ("0.1", "0.5", "1", "2", "10", "max")
RESTART, CONFIRM_RESTART = "Restart", "Click again to restart"
_ORDER = -10.0  # above all but the head of a cell
_SURE = 4.0  # [s] for the confirming click
_SETTLED = 1.5  # [s] after a click on the slider before it follows time again


class SeenPace:
    """Measured real-time factor over the last two seconds."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()

    def take(self, wall: float, time: float) -> None:
        """Add a simulation time [s] that was reported at `wall` [s]."""
        if self._seen and time < self._seen[-1][1]:
            self._seen.clear()  # the run was reset
        self._seen.append((wall, time))
        while len(self._seen) > 2 and self._seen[0][0] < wall - _SPAN:
            self._seen.popleft()

    @property
    def factor(self) -> float | None:
        """Real-time factor; None until it is known."""
        if len(self._seen) < 2:
            return None
        (wall, time), (wall_now, time_now) = self._seen[0], self._seen[-1]
        return (time_now - time) / (wall_now - wall) if wall_now > wall else None


class TimeControls(Feature):
    """Clock, pause, single steps, speed and reset; a timeline for recordings."""

    def __init__(self) -> None:
        self._is_up = False
        self._pace = SeenPace()
        self._first_click = -_SURE
        self._slid_at = -_SETTLED
        self._slider: Any = None
        self._now = 0.0
        self._timestep = 1 / 500

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Create the controls, once."""
        value = self.page.link.welcome.get("timestep")
        if isinstance(value, list) and len(value) == 2:
            self._timestep = value[0] / value[1]
        if self._is_up:
            return
        self._is_up, gui = True, self.page.server.gui
        self._clock = gui.add_html("", order=_ORDER)
        self._steps = gui.add_button_group(
            "time",
            (PAUSE, RESUME, STEP, SECOND),
            order=_ORDER + 1,
            hint="Pause, resume, or advance by one step or one second",
        )
        self._speeds = gui.add_button_group(
            "speed", SPEEDS, order=_ORDER + 2, hint="Simulated seconds per second; max: as fast as possible"
        )
        self._reset = gui.add_button(RESTART, order=_ORDER + 3, color="gray", visible=False)
        self._steps.on_click(lambda event: self._step(str(event.target.value)))
        self._speeds.on_click(lambda event: self._set_speed(str(event.target.value)))
        self._reset.on_click(lambda _: self._on_reset())

    def panel(self, panel: dict[str, Any]) -> None:
        """Show the state of time."""
        control = panel.get("control")
        if not self._is_up or control is None:
            return
        try:
            now = seconds_of(panel)
        except (KeyError, TypeError, ValueError):  # the panel of another version
            return
        self._now = now
        self._pace.take(time.perf_counter(), now)
        self._clock.content = clock(now, control, self._pace.factor)
        reasons = control["refused"]
        for group, action in ((self._steps, "pause"), (self._speeds, "speed")):
            # viser disables no group of buttons.
            group.visible = not reasons.get(action)
        self._show_reset(panel, str(reasons.get("reset", "")))
        self._show_timeline(panel, now)

    def on_disconnect(self, reason: str) -> None:
        """Show the last known time, and disable the controls: the server does not answer."""
        if not self._is_up:
            return
        self._clock.content = _standing(self._now, "not connected", reason)
        for handle in (self._steps, self._speeds, self._reset, self._slider):
            if handle is not None:
                handle.visible = False

    def _show_reset(self, panel: dict[str, Any], reason: str) -> None:
        button = self._reset
        is_sure = time.perf_counter() - self._first_click < _SURE
        button.label = CONFIRM_RESTART if is_sure else RESTART
        button.color = "red" if is_sure else "gray"
        button.visible = panel.get("kind") != "robot"  # whose own controls send it home
        button.disabled = bool(reason)
        button.hint = reason or "Restart the run; its progress is lost"

    def _show_timeline(self, panel: dict[str, Any], now: float) -> None:
        begin, end = panel.get("begin"), panel.get("end")
        if begin is None or end is None:
            if self._slider is not None:
                self._slider.visible = False
            return
        last = max(end, begin + 0.1)
        if self._slider is None:
            self._slider = self.page.server.gui.add_slider(
                "time [s]", min=begin, max=last, step=0.1, initial_value=begin, order=_ORDER + 0.5
            )
            self._slider.on_update(self._seek)
        self._slider.visible = True
        # The server may have opened another recording.
        self._slider.min, self._slider.max = begin, last
        if time.perf_counter() - self._slid_at > _SETTLED:
            # viser sends only changes: the same value again would undo the browser's last move
            self._slider.value = round(min(max(now, begin), end), 1)

    def _step(self, word: str) -> None:
        if word == PAUSE:
            self._ask(action="pause")
        elif word == RESUME:
            self._ask(action="resume")
        else:
            self._ask(action="step", ticks=1 if word == STEP else max(1, round(1.0 / self._timestep)))

    def _set_speed(self, word: str) -> None:
        self._ask(action="speed", factor="max" if word == "max" else float(word))

    def _on_reset(self) -> None:
        now = time.perf_counter()
        if now - self._first_click < _SURE:
            self._first_click = -_SURE
            self._ask(action="reset")
        else:
            self._first_click = now
            self._reset.label = CONFIRM_RESTART

    def _seek(self, event: Any) -> None:
        if event.client is not None:  # not when it follows time
            self._slid_at = time.perf_counter()
            self._ask(action="seek", time=float(event.target.value))

    def _ask(self, **request: Any) -> None:
        try:
            self.page.link.ask(CONTROL, **request)
        except CellwrightError as error:
            self.page.notify(f"{request['action']}: refused", str(error), is_bad=True)


def seconds_of(panel: dict[str, Any]) -> float:
    """Simulation time [s] of a panel."""
    if "clock" in panel:
        return float(panel["clock"]["time"])
    value = panel.get("time", 0)
    return value / 1e9 if panel.get("kind") == "robot" else float(value)


def clock(now: float, control: dict[str, Any], pace: float | None) -> str:
    """Clock as HTML: a simulation time [s], and the requested and measured real-time factor."""
    if control.get("over"):
        return _standing(now, "over", f"{control['over']}: the page shows the final state")
    if control["paused"]:
        label = widgets.chip("stepping" if control["ticks_left"] else "paused", AMBER)
    elif control["lockstep"]:
        label = widgets.chip("lockstep", BLUE)
    else:
        label = widgets.chip("running", GREEN)
    requested = "as fast as possible" if control["speed"] == "max" else f"target {control['speed']:g} ×"
    seen = "" if pace is None or control["paused"] else f"{pace:.1f} × real time, "
    return widgets.block(
        widgets.row(widgets.big(f"{now:.2f}", "s"), label, "align-items:center"), widgets.figures(f"{seen}{requested}")
    )


def _standing(now: float, state: str, reason: str) -> str:
    """Clock as HTML when time passes no more."""
    row = widgets.row(widgets.big(f"{now:.2f}", "s"), widgets.chip(state, GREY), "align-items:center")
    return widgets.block(row, widgets.dim(reason))
