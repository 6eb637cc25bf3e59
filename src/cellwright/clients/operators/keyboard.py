"""Keyboard operator: terminal input decoded into keys, keys into jog steps, and the loop that sends them.

A key is one step. The first step begins at the robot's measured position, and so does the first one after another
source has moved it. The next ones continue from the target before. A target never runs far ahead of a blocked robot.
"""

import math
import re
from collections.abc import Callable

from cellwright.clients.operators.robot import (
    Ask,
    JointLimits,
    MoveGrippers,
    MoveJoints,
    MoveTips,
    Now,
    OperatedRobot,
    Order,
    ServiceCaller,
)
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose, normalized

_ENDS = {"A": "up", "B": "down", "C": "right", "D": "left", "H": "home", "F": "end"}
_SEQUENCES = {
    **{start + end: key for start in "[O" for end, key in _ENDS.items()},
    "[1~": "home",
    "[4~": "end",
    "[5~": "pageup",
    "[6~": "pagedown",
}
_CONTROLS = {"\r": "enter", "\n": "enter", "\x7f": "backspace", "\x08": "backspace", "\t": "tab", "\x03": "ctrl-c"}
_ESCAPE = "\x1b"
# a character, or a complete sequence behind an escape; one of `[` has an end within 16 characters, or none
_KEY = re.compile(r"[^\x1b]|\x1b(O.|\[(?:[^@-~]{0,14}[@-~]|.{15})|[^O\[\x1b]|(?=\x1b))", re.DOTALL)
JOINT_STEPS = (0.005, 0.02, 0.05, 0.1, 0.2)
"""Steps of a joint, or of a tip's rotation [rad]; of a sliding joint [m], at most a tenth of its range."""
TIP_STEPS = (0.002, 0.005, 0.01, 0.02, 0.05)
"""Steps of a tip's position [m]."""
GRIPPER_STEPS = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Steps of a gripper, as a share of its range."""
SIDES = ("right", "left")
KEY_HELP = (
    ("↑ ↓ PgUp PgDn", "choose a joint"),
    ("/", "find a joint by its name"),
    ("← →", "move the joint a step"),
    ("- +", "smaller, larger steps"),
    ("t", "the other arm and gripper"),
    ("x X  y Y  z Z", "move its tip: + and -"),
    ("r R  p P  w W", "roll, pitch, yaw: + and -"),
    ("f", "axes: the base's, the tip's"),
    ("o c  , .", "open, close gripper; step"),
    ("H", "go home"),
    ("e d", "take commands, or none"),
    ("SPACE", "EMERGENCY STOP"),
    ("u", "end the emergency stop"),
    ("q", "quit; the robot stays"),
)
"""Keys, and their actions."""
_PAGE = 10
_JOINT_LEAD = 0.2  # [rad; m] that a target may be ahead of the joint; three steps if that is more
_TIP_LEAD = 0.1  # [m]
_MOVES = {"x": (0, 1), "X": (0, -1), "y": (1, 1), "Y": (1, -1), "z": (2, 1), "Z": (2, -1)}
_TURNS = {"r": (0, 1), "R": (0, -1), "p": (1, 1), "P": (1, -1), "w": (2, 1), "W": (2, -1)}
_SERVICES = {"H": Ask.HOME, "e": Ask.ENABLE, "d": Ask.DISABLE, "u": Ask.CLEAR_STOP}
POLL_INTERVAL = 0.02
"""Time between reads of the keyboard [s]."""
POLLS_PER_REDRAW = 5
"""Reads of the keyboard per redraw."""
MAX_STEPS = 3
"""Largest number of steps from one read: input that piled up during a stall is old, and is dropped."""


class KeyDecoder:
    """Decoder of terminal text into keys: a printed character is its own key, others have names.

    Sequences may come in pieces. Unknown ones are skipped whole, so that none of their characters is taken for a key.
    """

    def __init__(self) -> None:
        self._rest = ""

    def feed(self, text: str) -> list[str]:
        """Return the keys in a piece of text. An empty piece means that the input pauses: an escape alone is a key."""
        if not text:
            keys = ["escape"] if self._rest == _ESCAPE else []
            self._rest = ""
            return keys
        keys, text, at = [], self._rest + text, 0
        while match := _KEY.match(text, at):
            at, sign, sequence = match.end(), match[0], match[1]
            if sequence is None:
                keys.append(_CONTROLS.get(sign, sign if sign.isprintable() else ""))
            else:
                keys.append(_SEQUENCES.get(sequence, ""))
        self._rest = text[at:]
        return [key for key in keys if key]


class Jog:
    """Selection of the operator; turns keys into orders."""

    def __init__(self, robot: OperatedRobot, limits: JointLimits) -> None:
        self._robot = robot
        self._limits = limits
        self._chosen = 0
        self.arm = 0
        """Index of the selected arm and gripper."""
        self.size = 1
        """Index of the selected step size."""
        self.in_tip_frame = False
        """True if tips move along their own axes instead of the base's."""
        self.search: str | None = None
        """Text to find in a joint's name during a search; None otherwise."""
        self.note = ""
        """Result of the newest key, in a sentence."""
        self.joint_targets: dict[str, float] = {}
        """Targets of the joints that were moved here [rad; m]."""
        self.tip_targets: tuple[Pose, ...] = ()
        """Targets of the tips, if those were moved here."""
        self._grips: tuple[float, ...] = ()

    @property
    def joint(self) -> str:
        """The selected joint; empty where the node publishes none."""
        joints = self._robot.joints
        return joints[min(self._chosen, len(joints) - 1)] if joints else ""

    @property
    def joint_step(self) -> float:
        """Step of the selected joint [rad; m]."""
        limits = self._limits.of_joint(self.joint)
        span = limits.upper - limits.lower
        return min(JOINT_STEPS[self.size], span / 10.0) if span > 0.0 else JOINT_STEPS[self.size]

    def forget(self) -> None:
        """Forget all targets, when something else moves or holds the robot: the next step begins at its position."""
        self.joint_targets, self.tip_targets, self._grips = {}, (), ()

    def press(self, key: str) -> Order | None:
        """Return the order of a key; None if it changed something here, or nothing."""
        self.note = ""
        if key == " ":  # in every mode
            self.search = None
            self.forget()
            return Now.STOP
        if key == "ctrl-c":
            return Now.QUIT
        if self.search is not None:
            self._search_joint(key)
            return None
        if key == "q":
            return Now.QUIT
        if key in _SERVICES:
            self.forget()
            return _SERVICES[key]
        return None if self._choose(key) else self._move(key)

    def _choose(self, key: str) -> bool:
        last = max(0, len(self._robot.joints) - 1)
        steps = {"up": -1, "down": 1, "pageup": -_PAGE, "pagedown": _PAGE, "home": -last, "end": last}
        if key in steps:
            self._chosen = min(max(self._chosen + steps[key], 0), last)
        elif key == "/":
            self.search = ""
        elif key in "-+=":
            self.size = min(max(self.size + (-1 if key == "-" else 1), 0), len(JOINT_STEPS) - 1)
        elif key == "t":
            count = max(len(self._robot.tips), len(self._robot.grippers))
            self.arm = (self.arm + 1) % count if count else 0
        elif key == "f":
            self.in_tip_frame = not self.in_tip_frame
        else:
            return False
        return True

    def _search_joint(self, key: str) -> None:
        searched = self.search or ""
        if key in ("enter", "escape"):
            self.search = None
        elif key == "backspace":
            self.search = searched[:-1]
        elif len(key) == 1:
            part = searched + key
            found = [number for number, name in enumerate(self._robot.joints) if part.lower() in name.lower()]
            if found:
                self._chosen, self.search = found[0], part
            else:
                self.note = f"no joint has {part!r} in its name"

    def _move(self, key: str) -> Order | None:
        moves = {
            **dict.fromkeys(("left", "right"), self._move_joint),
            **dict.fromkeys((*_MOVES, *_TURNS), self._move_tip),
            **dict.fromkeys("oc,.", self._move_gripper),
        }
        if key not in moves:
            return None
        reason = self._robot.why_not()
        if reason:
            self.forget()
            self.note = f"not sent: {reason}"
            return None
        return moves[key](key)

    def _move_joint(self, key: str) -> Order | None:
        joint, step = self.joint, self.joint_step
        if not joint:
            self.note = "the node publishes no joints"
            return None
        measured = self._robot.positions.get(joint)
        if measured is None:
            self.note = f"the node publishes no position of {joint}"
            return None
        # Keys that go on while the joint is blocked must not pile up a distance that it would jump once it is free.
        lead = max(_JOINT_LEAD, 3.0 * step)
        goal = self.joint_targets.get(joint, measured) + (step if key == "right" else -step)
        target = min(max(goal, measured - lead), measured + lead)
        if target != goal:
            self.note = f"{joint} is blocked at {measured:.3f}"
        within = self._limits.clamped(joint, target)
        if within != target:
            self.note = f"{joint} is at its limit"
        self.tip_targets = ()
        self.joint_targets[joint] = within
        return MoveJoints({joint: within})

    def _move_tip(self, key: str) -> Order | None:
        measured = self._robot.tips
        if self.arm >= len(measured):
            self.note = "no such tip on /io_teleop/state_ee_poses"
            return None
        tips = list(self.tip_targets if len(self.tip_targets) == len(measured) else measured)
        tip = self._stepped(tips[self.arm], key)
        away = math.dist(tip.position, measured[self.arm].position)
        if away > max(_TIP_LEAD, 3.0 * TIP_STEPS[self.size]):
            self.note = "the tip is blocked, or the pose is out of reach"
            return None
        tips[self.arm] = tip
        # a joint that the arm's kinematics moves is no longer where its own keys have put it
        self.joint_targets = {}
        self.tip_targets = tuple(tips)
        return MoveTips(self.tip_targets)

    def _stepped(self, tip: Pose, key: str) -> Pose:
        """Return a tip's target, base_T_tip, one step on."""
        axis, sign = (_MOVES if key in _MOVES else _TURNS)[key]
        step = [0.0, 0.0, 0.0]
        step[axis] = sign * (TIP_STEPS if key in _MOVES else JOINT_STEPS)[self.size]
        vector = (step[0], step[1], step[2])
        change = Pose(vector) if key in _MOVES else Pose.from_rpy((0.0, 0.0, 0.0), vector)
        if self.in_tip_frame:
            moved = tip @ change
        else:
            # in the base's frame the turn comes from the left, and leaves the position as it is
            turned = Pose(quaternion=change.quaternion) @ Pose(quaternion=tip.quaternion)
            x, y, z = (one + other for one, other in zip(tip.position, change.position, strict=True))
            moved = Pose((x, y, z), turned.quaternion)
        # products of many steps drift from unit length
        return Pose(moved.position, normalized(moved.quaternion))

    def _move_gripper(self, key: str) -> Order | None:
        measured = self._robot.grippers
        if self.arm >= len(measured):
            self.note = "no such gripper on /io_teleop/gripper_states"
            return None
        closed = list(self._grips if len(self._grips) == len(measured) else measured)
        step = GRIPPER_STEPS[self.size]
        goal = {"o": 0.0, "c": 1.0, ",": closed[self.arm] - step, ".": closed[self.arm] + step}[key]
        closed[self.arm] = min(max(goal, 0.0), 1.0)
        self._grips = tuple(min(max(value, 0.0), 1.0) for value in closed)
        return MoveGrippers(self._grips)


class Keyboard:
    """Drives a robot by keys."""

    def __init__(self, robot: OperatedRobot, jog: Jog, services: ServiceCaller) -> None:
        self.robot = robot
        self.jog = jog
        self.services = services
        self.message = ""
        """Message to the operator, in a sentence."""
        self._decoder = KeyDecoder()

    def run(self, read: Callable[[], str], draw: Callable[[], None]) -> None:
        """Drive until a key quits; `read` returns the text typed since its last call, and never waits."""
        looks = 0
        while self.take(read()):
            if looks % POLLS_PER_REDRAW == 0:
                draw()
            looks += 1
            self.robot.session.sleep(POLL_INTERVAL)

    def take(self, text: str) -> bool:
        """Handle typed text; False when it quits."""
        answer = self.services.answer()
        if answer:
            self.message = answer
            self.jog.forget()
        status = self.robot.status
        if self.robot.why_not() or (status is not None and status.silent):
            self.jog.forget()  # the node holds the robot at its position
        keys = self._decoder.feed(text)
        # Keys typed before the stop are dropped.
        if " " in keys:
            keys = keys[keys.index(" ") :]
        steps = 0
        for key in keys:
            order = self.jog.press(key)
            self.message = self.jog.note or ("" if order is None and self.jog.search is None else self.message)
            if order is Now.QUIT:
                return False
            if isinstance(order, MoveJoints | MoveTips | MoveGrippers):
                steps += 1
                if steps > MAX_STEPS:
                    self.jog.forget()
                    self.message = "keys came too fast for the robot; the oldest were sent"
                    continue
            if order is not None:
                self._execute(order)
        return True

    def _execute(self, order: Order) -> None:
        try:
            if isinstance(order, Ask):
                begun = self.services.begin(order)
                self.message = f"{order.value} …" if begun else f"still waiting for: {self.services.pending}"
            else:
                self.robot.send(order)
                self.message = "EMERGENCY STOP sent; u ends it" if order is Now.STOP else self.jog.note
        except CellwrightError as error:  # refused; RunEndedError is none of these
            self.jog.forget()
            self.message = str(error)
