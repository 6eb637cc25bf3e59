"""Operator tab of a robot's page: emergency stop, state, grippers, joints and base."""

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any

from cellwright.clients.operators.robot import Ask
from cellwright.config.robot.config import BaseMode
from cellwright.rendering.scene import Scene
from cellwright.viewer.web import widgets
from cellwright.viewer.web.operator import moves
from cellwright.viewer.web.operator.command_queue import READ_ONLY, CommandQueue
from cellwright.viewer.web.operator.handles import Handles
from cellwright.viewer.web.operator.robot_state import RobotState, SeenGroup, SeenJoint
from cellwright.viewer.web.operator.worker import Worker
from cellwright.viewer.web.page import Feature
from cellwright.viewer.web.widgets import AMBER, GREEN, GREY, RED

_STEPS = (0.0001, 0.0005, 0.001, 0.005, 0.01)  # of sliders [rad; m]
_FINENESS = 500  # steps from end to end, at least
_OPEN, _CLOSE = "Open", "Close"
_TOP = -30.0  # above all else on the page
_FOLLOWS = 0.12  # [s] between two updates of the sliders
_ASKED = 1.5  # [s] for which a switch keeps its new state, until the robot follows
TAB = "Drive"


def pill(state: RobotState | None) -> tuple[str, str]:
    """Short text of the robot's state, and its colour."""
    if state is None:
        return "not connected", GREY
    if state.is_stopped:
        return "EMERGENCY STOP", RED
    if not state.is_enabled:
        return "disabled", AMBER
    if state.is_homing:
        return "going home", AMBER
    if state.is_silent:
        return "held", AMBER
    return ("following", GREEN) if state.commander else ("idle", GREY)


def state_html(queue: CommandQueue, now: float) -> str:
    """State, commander, refusals, delay and the newest note as HTML."""
    state = queue.state
    lines = [widgets.chip(*pill(state))]
    if state is not None:
        if state.commander:
            lines[0] += f" {widgets.text(state.commander)}"
        elif state.why_not or state.is_silent:
            lines.append(f"<div>{widgets.text(state.message)}</div>")
        counts = f"{state.taken} commands accepted"
        counts += f", {state.refused} refused" if state.refused else ""
        counts += f", {state.ignored} ignored" if state.ignored else ""
        delay = queue.delay.seconds
        counts += "" if delay is None else f" · delay {delay * 1e3:.0f} ms"
        lines.append(widgets.dim(counts))
    note = queue.notes.at(now)
    if note:
        colour = f"color:{RED};" if queue.notes.is_bad else ""
        lines.append(f'<div style="{colour}font-weight:600">{widgets.text(note)}</div>')
    return widgets.block(*lines, style="overflow-wrap:anywhere")


class Sliders:
    """Sliders of a robot in viser's GUI; their moves go to the command queue."""

    def __init__(self, gui: Any, queue: CommandQueue) -> None:
        self._gui, self._queue = gui, queue
        self._joints: list[tuple[int, Any, str]] = []  # joint, slider, its label at rest
        self._grips: list[Any] = []
        self._both: list[Any] = []

    def add_grips(self, names: Sequence[str]) -> None:
        """Add a slider for each gripper, with buttons for open and closed."""
        gui, queue = self._gui, self._queue
        for number, name in enumerate(names):
            slider = gui.add_slider(
                f"{name} closed".strip().capitalize(), min=0.0, max=100.0, step=1.0, initial_value=0.0, hint="%"
            )

            async def close(event: Any, number: int = number) -> None:
                if event.client_id is not None:
                    queue.grip(number, float(event.target.value) / 100.0)

            slider.on_update(close)
            self._grips.append(slider)
            both = gui.add_button_group("", (_OPEN, _CLOSE))

            async def press(event: Any, number: int = number) -> None:
                if event.target.value in (_OPEN, _CLOSE):
                    queue.grip(number, float(event.target.value == _CLOSE))

            both.on_click(press)
            self._both.append(both)

    def add_joints(self, group: SeenGroup) -> None:
        """Add a slider for each movable joint of a group."""
        queue, robot = self._queue, self._queue.robot
        joints = [robot.joints[number] for number in group.joints]
        for number, seen, name in zip(group.joints, joints, short_names([each.name for each in joints]), strict=True):
            if seen.upper <= seen.lower:
                continue  # fixed
            slider = self._gui.add_slider(
                name,
                min=seen.lower,
                max=seen.upper,
                step=step_of(seen),
                initial_value=robot.clamped(number, 0.0),
                hint=f"{seen.name}: {seen.lower:.4g} to {seen.upper:.4g} {seen.unit}",
            )

            async def slide(event: Any, number: int = number) -> None:
                if event.client_id is not None:  # not when it follows its joint
                    queue.slide(number, float(event.target.value))

            slider.on_update(slide)
            self._joints.append((number, slider, name))

    def allow(self, *, is_allowed: bool) -> None:
        """Enable or disable the sliders."""
        for handle in (*self._grips, *(slider for _, slider, _ in self._joints)):
            handle.disabled = not is_allowed
        for group in self._both:
            # viser disables no group of buttons.
            group.visible = is_allowed

    def show(self, state: RobotState, now: float) -> None:
        """Move the sliders to the robot's state at `now` [s]."""
        for number, slider in enumerate(self._grips):
            if not self._queue.grips.is_touched(number, now):
                slider.value = float(round(100.0 * state.grippers[number]))
        for joint, slider, name in self._joints:
            if (measured := state.positions[joint]) is None:
                continue
            place = self._queue.robot.clamped(joint, measured)
            step = step_of(self._queue.robot.joints[joint])
            is_off = not abs(slider.value - place) <= step  # also if a browser sent NaN
            # The label of a touched slider has the measured position.
            is_touched = self._queue.joints.is_touched(joint, now)
            slider.label = f"{name} ({measured:.2f})" if is_off and is_touched else name
            if is_off and not is_touched:
                slider.value = place


def step_of(joint: SeenJoint) -> float:
    """Step of a joint's slider [rad; m]: a round number, and fine enough."""
    max_step = (joint.upper - joint.lower) / _FINENESS
    return max([step for step in _STEPS if step <= max_step], default=_STEPS[0])


def short_names(names: Sequence[str]) -> list[str]:
    """Names without their common first words: space beside a slider is narrow."""
    if len(names) < 2:
        return list(names)
    words = [name.split("_") for name in names]
    common = 0
    while all(len(each) > common + 1 and each[common] == words[0][common] for each in words):
        common += 1
    return ["_".join(each[common:]) for each in words]


class Controls:
    """Operator tab, with stop button and state above all tabs.

    Args:
        gui: viser's GUI.
        tab: opens the tab.
        queue: command queue for the requests.
        handles: handles of the hands; the tab has their switches.
        stop: sends an emergency stop at once; returns what prevents it, or an empty text.
    """

    def __init__(
        self,
        gui: Any,
        tab: Callable[[], AbstractContextManager[Any]],
        queue: CommandQueue,
        handles: Handles,
        stop: Callable[[], str],
    ) -> None:
        self._gui, self._queue, self._all_handles = gui, queue, handles
        self._switched = self._followed = self._now = float("-inf")
        self._made: list[Any] = []
        self._buttons: list[Any] = []  # disabled while the robot does not answer
        self._sliders = Sliders(gui, queue)
        self._enabled: Any = None
        self._home: Any = None
        self._build_head(stop)
        with tab():
            if queue.robot.is_real:
                notice = widgets.block(widgets.dim(f"{READ_ONLY[0].upper()}{READ_ONLY[1:]}."))
                self._keep(gui.add_html(notice))
            else:
                self._build()

    def remove(self) -> None:
        """Remove all controls."""
        for each in self._made:
            each.remove()

    def _build_head(self, stop: Callable[[], str]) -> None:
        gui, queue = self._gui, self._queue
        hint = "Emergency stop: the robot holds at once"
        button = self._keep(gui.add_button("STOP", color="red", icon="hand-stop", order=_TOP, hint=hint))

        # viser calls this in a thread of its own, so it may block.
        def press(event: Any) -> None:
            refusal = stop()
            if refusal and event.client is not None:
                event.client.add_notification(title="Not stopped yet", body=refusal, color="red")

        button.on_click(press)
        self._state = self._keep(gui.add_html("", order=_TOP + 1))
        hint = "The robot stays where it is until the next command"
        self._clear = self._keep(
            gui.add_button("Clear emergency stop", icon="lock-open", visible=False, order=_TOP + 2, hint=hint)
        )
        self._clear.on_click(lambda _event: queue.ask(Ask.CLEAR_STOP))
        self._buttons.append(self._clear)

    def _build(self) -> None:
        gui, queue, robot = self._gui, self._queue, self._queue.robot
        self._enabled = self._keep(
            gui.add_checkbox(
                "Accept commands", initial_value=True, hint="Off: the robot holds and ignores all commands"
            )
        )
        self._enabled.on_update(self._switch)
        self._home = self._keep(
            gui.add_button(
                "Go home", icon="home", hint="Arms, waist and head move to the start posture, and the grippers open"
            )
        )
        self._home.on_click(lambda _event: queue.ask(Ask.HOME))
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
                self._build_base(BaseMode(robot.base_mode))

    def _build_switches(self) -> None:
        handles, gui = self._all_handles, self._gui
        shown = self._keep(gui.add_checkbox("Handles at the hands", initial_value=True))
        hint = "Handles move along the hand's own axes, not the world's"
        along = self._keep(gui.add_checkbox("Along the hand's axes", initial_value=False, hint=hint))

        async def switch(_event: Any) -> None:
            handles.is_shown, handles.along_hand = bool(shown.value), bool(along.value)

        shown.on_update(switch)
        along.on_update(switch)

    def _build_base(self, mode: BaseMode) -> None:
        queue = self._queue
        for direction in moves.base_directions(mode):
            button = self._gui.add_button(direction.capitalize(), hint="The base moves while the button is held")
            self._buttons.append(button)

            async def push(_event: Any, direction: str = direction) -> None:
                queue.drive(direction)

            button.on_hold(push, callback_hz=moves.BUTTON_RATE)

    async def _switch(self, event: Any) -> None:
        if event.client_id is not None:
            self._switched = self._now
            self._queue.ask(Ask.ENABLE if event.target.value else Ask.DISABLE)

    def _keep(self, handle: Any) -> Any:
        self._made.append(handle)
        return handle

    def show(self, state: RobotState | None, now: float) -> None:
        """Show the robot's state at `now` [s]; without a state, enable nothing but the stop."""
        self._now = now
        if state is not None and now - self._followed < _FOLLOWS:
            return
        self._followed = now
        self._state.content = state_html(self._queue, now)
        for handle in self._buttons:
            handle.disabled = state is None
        if self._home is not None:
            self._home.disabled = state is None or bool(state.why_not)
        self._sliders.allow(is_allowed=state is not None)
        if state is None:
            return
        self._clear.visible = state.is_stopped and not self._queue.robot.is_real
        if self._enabled is not None and now - self._switched > _ASKED:
            self._enabled.value = state.is_enabled
        self._sliders.show(state, now)


class Operator(Feature):
    """Operator of the page's robot, once a panel shows that it is one."""

    def __init__(self) -> None:
        self._worker: Worker | None = None
        self._handles: Handles | None = None
        self._controls: Controls | None = None
        self._shown: CommandQueue | None = None  # the queue of the current handles and controls
        self._is_robot = False

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Start another scene: its handles went with the previous one."""
        self._handles = self._shown = None
        # Shown now, so that its tab comes first.
        self.panel(self.page.first_panel)

    def panel(self, panel: dict[str, Any]) -> None:
        """Start the operator if the panel is of a robot."""
        self._is_robot = panel.get("kind") == "robot"
        if self._is_robot and self._worker is None:
            self._worker = worker = Worker(self.page.link.address)
            server = self.page.server
            server.on_client_connect(lambda _client: setattr(worker, "is_watched", True))
            server.on_client_disconnect(lambda _client: setattr(worker, "is_watched", bool(server.get_clients())))
            worker.start()
            self.page.tab(TAB)

    def on_frame(self, answer: dict[str, Any]) -> None:  # noqa: ARG002
        """Show the robot's state."""
        if self._worker is None or (queue := self._worker.queue) is None or not self._is_robot:
            return
        if queue is not self._shown:
            self._build(queue, self._worker)
        if self._handles is not None and self._controls is not None:
            self._handles.show(queue.state)
            self._controls.show(queue.state, time.perf_counter())

    def on_disconnect(self, reason: str) -> None:  # noqa: ARG002
        """Disable all controls: the server does not answer."""
        if self._shown is not None:
            self._shown.lose()
        if self._handles is not None and self._controls is not None:
            self._handles.show(None)
            self._controls.show(None, time.perf_counter())

    def _build(self, queue: CommandQueue, worker: Worker) -> None:
        page = self.page
        if self._controls is not None:
            self._controls.remove()
        self._shown = queue
        self._handles = Handles(page.server.scene, page.root, queue)
        self._controls = Controls(page.server.gui, lambda: page.tab(TAB), queue, self._handles, worker.stop)
