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
from cellwright.viewer.web.operator.moves import Grips, Hands, JointMoves
from cellwright.viewer.web.operator.robot_state import Delay, Reach, ReachOfHand, SeenRobot, Standing

NOTE_DURATION = 6.0  # [s] for which a note is shown
NOTE_GAP = 1.0  # [s] between two notes of the same kind, at least


class Notes:
    """Newest note."""

    def __init__(self) -> None:
        self.text = ""
        self.is_bad = False
        self._until = 0.0
        self._told: dict[str, float] = {}

    def tell(self, text: str, now: float, *, kind: str = "", is_bad: bool = False) -> None:
        """Show a note from `now` [s] on; drop one of a kind that was shown less than a second ago."""
        if kind and now - self._told.get(kind, float("-inf")) < NOTE_GAP:
            return
        if kind:
            self._told[kind] = now
        self.text, self.is_bad, self._until = text, is_bad, now + NOTE_DURATION

    def at(self, now: float) -> str:
        """Note to show at `now` [s]; empty if there is none."""
        return self.text if now < self._until else ""


Wish: TypeAlias = Order | MoveBase

READ_ONLY = "this robot is moved by a driver: the page shows it and stops it, and leaves driving to others"

_FARTHEST = 50.0  # [m]: a handle farther away is a mistake
_AT_REST = 1e-3  # [rad; m] that a joint at rest may move between two polls


class Desk:
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
        self.grips = Grips(len(robot.grippers))
        self.notes = Notes()
        self.delay = Delay()
        self.standing: Standing | None = None  # the newest state
        self.reach: tuple[Reach, ...] = ()
        """Reach of each hand."""
        self.wake = wake or threading.Event()
        self.active = float("-inf")  # [s], time of the last request
        self.spurned: dict[int, Pose] = {}
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
            if not self._may_move() or self.standing is None or not handle.is_finite():
                return False
            refusal = self.hands.grab(arm, browser, handle, self.standing)
            if refusal:
                self._tell(refusal, kind="grab", is_bad=True)
            else:
                self.joints.give_way(tuple(self._arm_joints))  # pose commands cover all arms
            return not refusal

    def drag(self, arm: int, browser: int, handle: Pose) -> None:
        """Drag a handle to world_T_handle."""
        with self._lock:
            if not handle.is_finite() or any(abs(value) > _FARTHEST for value in handle.position):
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
                self._tell("let go of the hand first: it moves the arms", kind="hand", is_bad=True)
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
                self._tell(READ_ONLY, kind="read only", is_bad=True)
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

    def due(self) -> list[Wish]:
        """Commands to send now, in order."""
        with self._lock:
            if self._is_stopping:
                return [Now.STOP]
            found: list[Wish] = list(self._asks)
            self._asks.clear()
            if self.standing is not None and not self.standing.why_not:
                found += self._moves(self.standing, self._clock())
            return found

    def _moves(self, standing: Standing, now: float) -> list[Wish]:
        found: list[Wish] = []
        if (tips := self.hands.due(standing, now)) is not None:
            found.append(MoveTips(tips))
        if targets := self.joints.due(standing, now):
            found.append(MoveJoints({self.robot.joints[joint].name: value for joint, value in targets.items()}))
        if self.joints.note:
            self._tell(self.joints.note)
            self.joints.note = ""
        if (closed := self.grips.due(standing, now)) is not None:
            found.append(MoveGrippers(closed))
        if self._base is not None:
            found.append(self._base)
            self._base = None
        if found:
            self.active = now
        return found

    def sent(self, wish: Wish) -> None:
        """Confirm that a command was sent."""
        with self._lock:
            if wish is Now.STOP:
                self._is_stopping = False
                self._tell("EMERGENCY STOP sent", is_bad=True)

    def refused(self, reason: str) -> None:
        """Handle a refusal of the node: discard all requests."""
        with self._lock:
            held = {arm: self.hands.held(arm) for arm in range(len(self.robot.arms))}
            self.spurned = {arm: pose for arm, pose in held.items() if pose is not None}
            self._forget()
            self._tell(f"refused: {reason}", kind="refused", is_bad=True)

    def answered(self, text: str) -> None:
        """Show the answer of a service."""
        with self._lock:
            self._tell(text)

    def see(self, standing: Standing) -> None:
        """Handle a new state of the robot."""
        with self._lock:
            now, before = self._clock(), self.standing
            self.delay.look(standing, now)
            self.is_at_rest = before is not None and _is_at_rest(before, standing)
            has_begun_anew = before is not None and standing.time < before.time
            self.standing = standing
            self.reach = tuple(
                watch.look(standing.time, aim, tip)
                for watch, aim, tip in zip(self._watches, standing.aims, standing.tips, strict=True)
            )
            if (standing.why_not or has_begun_anew) and self._forget():
                self._tell(f"let go: {standing.why_not or 'the run has begun anew'}", is_bad=True)

    def lose(self) -> None:
        """Handle the loss of the robot."""
        with self._lock:
            self.standing = None
            self._asks.clear()
            self._forget()

    def _may_move(self) -> bool:
        if self.robot.is_real:
            self._tell(READ_ONLY, kind="read only", is_bad=True)
            return False
        if self.standing is None or self._is_stopping:
            return False
        if self.standing.why_not:
            self._tell(f"not sent: {self.standing.why_not}", kind="not sent", is_bad=True)
            return False
        return True

    def _begin(self, *, is_first: bool) -> None:
        self.active = self._clock()
        self.spurned.clear()
        if is_first and self.is_at_rest and self.standing is not None:
            self.delay.begin(self.standing, self.active)
        self.wake.set()

    def _forget(self) -> bool:
        """Discard all requests; return whether there were any."""
        self._base = None
        self.delay.forget()
        return any([self.hands.forget(), self.joints.forget(), self.grips.forget()])

    def _tell(self, text: str, *, kind: str = "", is_bad: bool = False) -> None:
        self.notes.tell(text, self._clock(), kind=kind, is_bad=is_bad)


def _is_at_rest(before: Standing, now: Standing) -> bool:
    pairs = zip(before.positions, now.positions, strict=True)
    return all(one is None or other is None or abs(one - other) < _AT_REST for one, other in pairs)
