"""Handles at the hands of a robot, and ghosts of their targets, in viser's scene."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from cellwright.util.pose import IDENTITY_QUATERNION, Pose
from cellwright.viewer.web.operator.command_queue import CommandQueue
from cellwright.viewer.web.operator.robot_state import Reach, RobotState, is_near, pose_of

BESIDE, SHORT, REFUSED = (36, 120, 210), (235, 120, 20), (205, 30, 30)
"""Colours of a ghost: a pose on the hand's way, out of reach, or refused."""

_SIZE = 0.2  # [m] of a handle
_RADIUS = 0.045  # [m] of a ghost
_SLIGHT = 5e-4  # [m; rad] of deviation before a handle is corrected


@dataclass(slots=True)
class _HandHandle:
    handle: Any
    ghost: Any
    axes: Any
    line: Any
    words: Any


class Handles:
    """Handle and ghost for each hand in viser's scene, below the node `root`; drags go to the command queue."""

    def __init__(self, scene: Any, root: str, queue: CommandQueue) -> None:
        self.is_shown = True
        """True to show the handles."""
        self.along_hand = False
        """True to move along the hand's own axes instead of the world's."""
        self._queue = queue
        self._hands = [self._made(scene, f"{root}/operator/{arm}", arm) for arm in range(len(queue.robot.arms))]

    def _made(self, scene: Any, name: str, arm: int) -> _HandHandle:
        handle = scene.add_transform_controls(
            f"{name}/handle", scale=_SIZE, line_width=3.0, depth_test=False, opacity=0.9, visible=False
        )
        queue = self._queue

        # viser calls this in the event loop, so that events keep their order.
        async def act(event: Any) -> None:
            browser = int(event.client_id)
            if event.phase == "end":
                queue.release(arm, browser)
                return
            try:
                world_T_handle = pose_of((*event.target.position, *event.target.wxyz))
            except ValueError:
                return  # a browser may send anything
            if event.phase == "start":
                queue.grab(arm, browser, world_T_handle)
            else:
                queue.drag(arm, browser, world_T_handle)

        handle.on_update(act)
        ghost = scene.add_icosphere(
            f"{name}/ghost", radius=_RADIUS, color=BESIDE, opacity=0.55, visible=False, cast_shadow=False
        )
        axes = scene.add_frame(f"{name}/axes", axes_length=0.1, axes_radius=0.004, visible=False)
        line = scene.add_line_segments(
            f"{name}/line", points=np.zeros((1, 2, 3), np.float32), colors=BESIDE, line_width=3.0, visible=False
        )
        words = scene.add_label(f"{name}/words", "", visible=False)
        return _HandHandle(handle, ghost, axes, line, words)

    def show(self, state: RobotState | None) -> None:
        """Show the robot's state; without one, hide all."""
        for arm, hand in enumerate(self._hands):
            if state is None:
                hand.handle.visible = False
                self._show_ghost(hand, None, None)
                continue
            self._show_handle(arm, hand, state)
            self._show_ghost(hand, self._ghost(arm, state), state.tips[arm])

    def _show_handle(self, arm: int, hand: _HandHandle, state: RobotState) -> None:
        is_of_use = self.is_shown and not state.why_not and not self._queue.robot.is_real
        hand.handle.visible = is_of_use
        if arm in self._queue.hands.holds:
            return
        tip = state.tips[arm]
        put(hand.handle, tip if self.along_hand else Pose(tip.position, IDENTITY_QUATERNION))

    def _ghost(self, arm: int, state: RobotState) -> tuple[Pose, tuple[int, int, int], str] | None:
        """Target of a hand, its colour and label; None if there is nothing to show."""
        refused = self._queue.refused_poses.get(arm)
        if refused is not None:
            return refused, REFUSED, "refused"
        aim, tip = self._queue.hands.held(arm) or state.aims[arm], state.tips[arm]
        if aim is None or is_near(aim, tip):
            return None
        if self._queue.reach[arm] is Reach.SHORT:
            return aim, SHORT, "out of reach"
        return aim, BESIDE, ""

    def _show_ghost(
        self, hand: _HandHandle, found: tuple[Pose, tuple[int, int, int], str] | None, tip: Pose | None
    ) -> None:
        is_visible = found is not None and tip is not None
        for each in (hand.ghost, hand.axes, hand.line):
            each.visible = is_visible
        hand.words.visible = found is not None and bool(found[2])
        if found is None or tip is None:
            return
        aim, colour, words = found
        for each in (hand.ghost, hand.axes):
            put(each, aim)
        hand.ghost.color = colour
        hand.line.colors = np.array(colour, np.uint8)
        hand.line.points = np.array([[tip.position, aim.position]], np.float32)
        if words:
            hand.words.text = words
            put(hand.words, Pose((aim.position[0], aim.position[1], aim.position[2] + 2 * _RADIUS)))


def put(handle: Any, pose: Pose) -> None:
    """Move a node to a pose, unless it is there: only changes are sent."""
    if not _is_near(handle.position, pose.position):
        handle.position = pose.position
    if not _is_near(handle.wxyz, pose.quaternion):
        handle.wxyz = pose.quaternion


def _is_near(found: Any, expected: tuple[float, ...]) -> bool:
    """Return whether numbers are close to others; the browser sets a handle's pose, so they may be anything."""
    numbers = np.asarray(found)
    if numbers.shape != (len(expected),) or numbers.dtype.kind not in "fiu":
        return False
    return bool(np.abs(numbers - np.array(expected)).max() <= _SLIGHT)
