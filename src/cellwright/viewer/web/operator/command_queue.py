"""Command queue of the operator: requests of browsers to a robot, from any thread, and notes about them.

A robot that accepts no commands gets none. Whatever holds it (a stop, a reset, disabling, a refusal) discards all
requests: the robot does not resume on its own.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import TypeAlias

from cellwright.clients.operators.robot import Ask, MoveBase, MoveGrippers, MoveJoints, MoveTips, Now, Order
from cellwright.config.robot.config import BaseMode
from cellwright.util.pose import Pose
from cellwright.viewer.web.operator import moves
from cellwright.viewer.web.operator.moves import GripperSliders, Hands, JointMoves
from cellwright.viewer.web.operator.robot_state import Delay, Reach, ReachOfHand, RobotState, SeenRobot

NOTE_DURATION = 6.0  # [s] for which a note is shown
NOTE_GAP = 1.0  # [s] between two notes of the same kind, at least
READ_ONLY = "a driver moves this robot; the page can only show and stop it"
_MAX_DISTANCE = 50.0  # [m]: a handle farther away is a mistake
_AT_REST = 1e-3  # [rad; m] that a joint at rest may move between two polls


class Notes:
    """Newest note."""

    def __init__(self) -> None:
        self.text = ""
        self.is_bad = False
        self._until = 0.0
        self._shown: dict[str, float] = {}

    def add(self, text: str, now: float, *, kind: str = "", is_bad: bool = False) -> None:
        """Show a note from `now` [s] on; drop one of a kind that was shown less than a second ago."""
        if kind and now - self._shown.get(kind, float("-inf")) < NOTE_GAP:
            return
        if kind:
            self._shown[kind] = now
        self.text, self.is_bad, self._until = text, is_bad, now + NOTE_DURATION

    def at(self, now: float) -> str:
        """Note to show at `now` [s]; empty if there is none."""
        return self.text if now < self._until else ""


Command: TypeAlias = Order | MoveBase


class CommandQueue:
    """Command queue of a robot's browsers.

    Args:
        robot: the robot.
        clock: returns the wall time [s].
        wake: set when there is work.
    """

    def __init__(
        self, robot: SeenRobot, clock: Callable[[], float] = time.perf_counter, wake: threading.Event | None = None
    ) -> None:
        self.robot = robot
        self.hands = Hands(len(robot.arms))
        self.joints = JointMoves(robot)
        self.grips = GripperSliders(len(robot.grippers))
        self.notes = Notes()
        self.delay = Delay()
        self.state: RobotState | None = None  # the newest state
        self.reach: tuple[Reach, ...] = ()
        """Reach of each hand."""
        self.wake = wake or threading.Event()
        self.active = float("-inf")  # [s], time of the last request
        self.refused_poses: dict[int, Pose] = {}
        """Requested world_T_tip of hands at the last refusal of the node; until the next request."""
        self._clock = clock
        self._watches = [ReachOfHand() for _ in robot.arms]
        self._asks: list[Ask] = []
        self._base: MoveBase | None = None
        self._is_stopping = False
        self.is_at_rest = False
        """True if no joint moved between the two newest polls."""
        self._lock = threading.RLock()
        self._arm_joints = {joint for group in robot.groups if group.kind == "arm" for joint in group.joints}

    def grab(self, arm: int, browser: int, handle: Pose) -> bool:
        """Grab the handle of a hand at world_T_handle; return False if refused."""
        with self._lock:
            if not self._may_move() or self.state is None or not handle.is_finite():
                return False
            refusal = self.hands.grab(arm, browser, handle, self.state)
            if refusal:
                self._note(refusal, kind="grab", is_bad=True)
            else:
                self.joints.give_way(tuple(self._arm_joints))  # pose commands cover all arms
            return not refusal

    def drag(self, arm: int, browser: int, handle: Pose) -> None:
        """Drag a handle to world_T_handle."""
        with self._lock:
            if not handle.is_finite() or any(abs(value) > _MAX_DISTANCE for value in handle.position):
                return
            had_strayed = self.hands.has_strayed(arm)
            if self.hands.move(arm, browser, handle, self._clock()):
                self._begin(is_first=not had_strayed and self.hands.has_strayed(arm))

    def release(self, arm: int, browser: int) -> None:
        """Release a handle."""
        with self._lock:
            self.hands.release(arm, browser)

    def slide(self, joint: int, position: float) -> bool:
        """Request a joint position [rad; m]; return False if refused."""
        with self._lock:
            if not 0 <= joint < len(self.robot.joints) or not math.isfinite(position) or not self._may_move():
                return False
            if joint in self._arm_joints and self.hands.holds:
                self._note("a held hand moves the arms; release it first", kind="hand", is_bad=True)
                return False
            now = self._clock()
            is_first = not self.joints.is_touched(joint, now)
            self.joints.ask(joint, position, now)
            self._begin(is_first=is_first)
            return True

    def grip(self, gripper: int, closed: float) -> bool:
        """Request a gripper closing, 0 to 1; return False if refused."""
        with self._lock:
            if not 0 <= gripper < len(self.robot.grippers) or not math.isfinite(closed) or not self._may_move():
                return False
            now = self._clock()
            is_first = not self.grips.is_touched(gripper, now)
            for group in self.robot.groups:
                if group.kind == "hand":
                    self.joints.give_way(group.joints)
            self.grips.ask(gripper, closed, now)
            self._begin(is_first=is_first)
            return True

    def drive(self, direction: str) -> None:
        """Drive the base while its button is held."""
        with self._lock:
            if self.robot.base_mode is None or direction not in moves.BASE_DIRECTIONS or not self._may_move():
                return
            self._base = MoveBase(moves.base_command(BaseMode(self.robot.base_mode), direction))
            self._begin(is_first=False)

    def ask(self, ask: Ask) -> None:
        """Request going home, enabling, disabling, or the end of a stop."""
        with self._lock:
            if self.robot.is_real:
                self._note(READ_ONLY, kind="read only", is_bad=True)
                return
            self._forget()
            if ask not in self._asks:
                self._asks.append(ask)
            self._begin(is_first=False)

    def stop(self) -> None:
        """Request an emergency stop. It precedes all other requests, and discards them."""
        with self._lock:
            self._is_stopping = True
            self._asks.clear()
            self._forget()
            self._begin(is_first=False)

    def due(self) -> list[Command]:
        """Commands to send now, in order."""
        with self._lock:
            if self._is_stopping:
                return [Now.STOP]
            found: list[Command] = list(self._asks)
            self._asks.clear()
            if self.state is not None and not self.state.why_not:
                found += self._moves(self.state, self._clock())
            return found

    def _moves(self, state: RobotState, now: float) -> list[Command]:
        found: list[Command] = []
        if (tips := self.hands.due(state, now)) is not None:
            found.append(MoveTips(tips))
        if targets := self.joints.due(state, now):
            found.append(MoveJoints({self.robot.joints[joint].name: value for joint, value in targets.items()}))
        if self.joints.note:
            self._note(self.joints.note)
            self.joints.note = ""
        if (closed := self.grips.due(state, now)) is not None:
            found.append(MoveGrippers(closed))
        if self._base is not None:
            found.append(self._base)
            self._base = None
        if found:
            self.active = now
        return found

    def sent(self, command: Command) -> None:
        """Confirm that a command was sent."""
        with self._lock:
            if command is Now.STOP:
                self._is_stopping = False
                self._note("EMERGENCY STOP sent", is_bad=True)

    def refused(self, reason: str) -> None:
        """Handle a refusal of the node: discard all requests."""
        with self._lock:
            held = {arm: self.hands.held(arm) for arm in range(len(self.robot.arms))}
            self.refused_poses = {arm: pose for arm, pose in held.items() if pose is not None}
            self._forget()
            self._note(f"refused: {reason}", kind="refused", is_bad=True)

    def answered(self, text: str) -> None:
        """Show the answer of a service."""
        with self._lock:
            self._note(text)

    def see(self, state: RobotState) -> None:
        """Handle a new state of the robot."""
        with self._lock:
            now, before = self._clock(), self.state
            self.delay.look(state, now)
            self.is_at_rest = before is not None and _is_at_rest(before, state)
            is_reset = before is not None and state.time < before.time
            self.state = state
            self.reach = tuple(
                watch.look(state.time, aim, tip)
                for watch, aim, tip in zip(self._watches, state.aims, state.tips, strict=True)
            )
            if (state.why_not or is_reset) and self._forget():
                self._note(f"released: {state.why_not or 'the run was restarted'}", is_bad=True)

    def lose(self) -> None:
        """Handle the loss of the robot."""
        with self._lock:
            self.state = None
            self._asks.clear()
            self._forget()

    def _may_move(self) -> bool:
        if self.robot.is_real:
            self._note(READ_ONLY, kind="read only", is_bad=True)
            return False
        if self.state is None or self._is_stopping:
            return False
        if self.state.why_not:
            self._note(f"not sent: {self.state.why_not}", kind="not sent", is_bad=True)
            return False
        return True

    def _begin(self, *, is_first: bool) -> None:
        self.active = self._clock()
        self.refused_poses.clear()
        if is_first and self.is_at_rest and self.state is not None:
            self.delay.begin(self.state, self.active)
        self.wake.set()

    def _forget(self) -> bool:
        """Discard all requests; return whether there were any."""
        self._base = None
        self.delay.forget()
        return any([self.hands.forget(), self.joints.forget(), self.grips.forget()])

    def _note(self, text: str, *, kind: str = "", is_bad: bool = False) -> None:
        self.notes.add(text, self._clock(), kind=kind, is_bad=is_bad)


def _is_at_rest(before: RobotState, now: RobotState) -> bool:
    pairs = zip(before.positions, now.positions, strict=True)
    return all(one is None or other is None or abs(one - other) < _AT_REST for one, other in pairs)
