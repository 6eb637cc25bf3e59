"""Terminal of the keyboard operator: raw key input, and the panel of robot state and keys.

The terminal is restored at every end: a return, an exception, Ctrl-C, SIGTERM, or a closed window.
"""

import codecs
import math
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cellwright.clients.operators.keyboard import GRIPPER_STEPS, JOINT_STEPS, KEY_HELP, SIDES, TIP_STEPS, Jog
from cellwright.clients.operators.robot import JointLimits, OperatedRobot
from cellwright.util.errors import UsageError

_PIECE = 4096
_GONE = "\x03"  # a lost keyboard counts as Ctrl-C

Read = Callable[[], str]
"""Returns the text typed since the last call; never waits."""

_BAR = 21  # characters from limit to limit; odd, so that there is a middle
_OFF = 0.01  # [rad; m] between target and position that is coloured
_MIN_JOINTS = 3  # lines of joints, however small the terminal


class TerminatedError(BaseException):
    """A signal to end this process; like KeyboardInterrupt it passes every `except Exception`."""


@contextmanager
def keyboard() -> Iterator[Read]:
    """Yield a reader of the keyboard of the terminal on stdin.

    Raises:
        UsageError: there is none.
        TerminatedError: from inside, on a signal to end the process.
    """
    if sys.stdin is None or not sys.stdin.isatty():
        raise UsageError("stdin is not a terminal; run the keyboard operator in one")
    if sys.platform == "win32":
        yield _read_windows
    else:
        with _ended_by_signals(), _key_by_key(sys.stdin.fileno()) as read:
            yield read


if sys.platform == "win32":
    import msvcrt

    _NAMED = {"H": "[A", "P": "[B", "M": "[C", "K": "[D", "G": "[H", "O": "[F", "I": "[5~", "Q": "[6~"}

    def _read_windows() -> str:
        text = ""
        while msvcrt.kbhit():
            sign = msvcrt.getwch()
            if sign in ("\x00", "\xe0"):  # an arrow or its like: the next one says which
                name = _NAMED.get(msvcrt.getwch(), "")
                sign = f"\x1b{name}" if name else ""
            text += sign
        return text

else:
    import termios
    import tty

    @contextmanager
    def _key_by_key(descriptor: int) -> Iterator[Read]:
        before = termios.tcgetattr(descriptor)
        decoder = codecs.getincrementaldecoder("utf-8")("replace")

        def read() -> str:
            if not select.select([descriptor], (), (), 0.0)[0]:
                return ""
            try:
                data = os.read(descriptor, _PIECE)
            except OSError:
                data = b""
            return decoder.decode(data) if data else _GONE

        try:
            tty.setcbreak(descriptor)  # Ctrl-C remains a signal
            mode = termios.tcgetattr(descriptor)
            for key in (termios.VSUSP, termios.VQUIT):  # these would leave the terminal to the shell as it is now
                mode[6][key] = b"\x00"
            termios.tcsetattr(descriptor, termios.TCSANOW, mode)
            yield read
        finally:
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into exceptions, so that clean-up runs."""
    before: dict[int, Any] = {}

    def end(number: int, _frame: FrameType | None) -> NoReturn:
        raise TerminatedError(signal.Signals(number).name)

    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name)
            before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def panel(
    robot: OperatedRobot, jog: Jog, limits: JointLimits, *, name: str, message: str, height: int = 24
) -> RenderableType:
    """Return the panel for a terminal of `height` lines: the robot's `name`, its state, a message and the keys."""
    keys, tips = _key_help(), _tips(robot, jog)
    rest = 2 + 1 + 1 + len(tips) + 1 + len(KEY_HELP) // 2
    joints = _joints(robot, jog, limits, max(_MIN_JOINTS, height - rest))
    note = f"find: {jog.search}▏ {message}" if jog.search is not None else message
    return Group(
        _status_line(robot, name), Text(), joints, Text(), *tips, Text(note, style="bold yellow", no_wrap=True), keys
    )


def _status_line(robot: OperatedRobot, name: str) -> Text:
    """Return one line: the robot, whether it takes commands, their source, and their number."""
    line = Text(no_wrap=True, overflow="ellipsis")
    line.append(f" {name} ", style="reverse bold").append("  ")
    status = robot.status
    if status is None:
        return line.append("the node does not publish /io_teleop/status", style="dim")
    reason = robot.why_not()
    if status.emergency_stop:
        line.append(" EMERGENCY STOP ", style="bold white on red")
    elif reason:
        line.append(reason, style="bold yellow")
    elif status.silent:
        line.append("holds: no command for too long", style="yellow")
    else:
        line.append("takes commands", style="green")
    line.append(f"  from {status.commander}" if status.commander else "")
    refused = f", {status.refused} refused" if status.refused else ""
    ignored = f", {status.ignored} ignored" if status.ignored else ""
    return line.append(f"  {status.taken} taken{refused}{ignored}", style="dim")


def _joints(robot: OperatedRobot, jog: Jog, limits: JointLimits, count: int) -> Table:
    """Return as many joints as fit, the selected one among them."""
    names, positions, applied = robot.joints, robot.positions, robot.applied
    chosen = names.index(jog.joint) if names else 0
    first = min(max(chosen - count // 2, 0), max(len(names) - count, 0))
    table = Table.grid(padding=(0, 2))
    for _ in range(2):
        table.add_column()
    table.add_column(justify="right", min_width=8)
    table.add_column(justify="right", min_width=8)
    table.add_column(no_wrap=True)
    table.add_row("", "", "measured", "applied", f"limits ({limits.source})" if limits.is_known else "", style="dim")
    for name in names[first : first + count]:
        is_chosen = name == jog.joint
        position, target = positions.get(name, math.nan), applied.get(name, math.nan)
        off = "yellow" if abs(target - position) > _OFF else ""
        table.add_row(
            "▶" if is_chosen else " ",
            Text(name, style="bold cyan" if is_chosen else ""),
            _number(position),
            Text("" if math.isnan(target) else _number(target), style=off),
            _bar(name, position, target, limits),
        )
    return table


def _number(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}"  # no sign before a zero


def _bar(name: str, position: float, target: float, limits: JointLimits) -> Text:
    """Return a bar with a joint's position between its limits, and its target."""
    limit = limits.of_joint(name)
    span = limit.upper - limit.lower
    if not 0.0 < span < math.inf or math.isnan(position):
        return Text()
    signs = list("─" * _BAR)

    def place(value: float) -> int:
        return min(max(round((value - limit.lower) / span * (_BAR - 1)), 0), _BAR - 1)

    if not math.isnan(target):
        signs[place(target)] = "◇"
    signs[place(position)] = "●"
    return Text(f"{limit.lower:7.2f} ").append("".join(signs), style="cyan").append(f" {limit.upper:.2f}")


def _tips(robot: OperatedRobot, jog: Jog) -> list[Text]:
    """Return a line for each arm and gripper, and one for the steps."""
    lines = []
    tips, grippers = robot.tips, robot.grippers
    for number in range(max(len(tips), len(grippers))):
        side = SIDES[number] if number < len(SIDES) else str(number)
        line = Text(no_wrap=True, overflow="ellipsis")
        line.append(f"{'▶' if number == jog.arm else ' '} {side:<6}", style="bold cyan" if number == jog.arm else "")
        if number < len(tips):
            x, y, z = tips[number].position
            roll, pitch, yaw = tips[number].rpy
            line.append(f" tip {x:6.3f} {y:6.3f} {z:6.3f} m, rpy {roll:5.2f} {pitch:5.2f} {yaw:5.2f}")
        if number < len(grippers):
            line.append(f", gripper {100 * grippers[number]:.0f} % closed")
        lines.append(line)
    steps = f"  steps: joint {jog.joint_step:.3g}, tip {TIP_STEPS[jog.size]:g} m and {JOINT_STEPS[jog.size]:g} rad"
    frame = "its own axes" if jog.in_tip_frame else "the base's axes"
    grip = f", gripper {100 * GRIPPER_STEPS[jog.size]:.0f} %" if grippers else ""
    return [*lines, Text(f"{steps} along {frame}{grip}", style="dim", no_wrap=True, overflow="ellipsis")]


def _key_help() -> Table:
    """Return the help, in two columns."""
    table = Table.grid(padding=(0, 2))
    half = len(KEY_HELP) // 2
    for row in zip(KEY_HELP[:half], KEY_HELP[half:], strict=True):
        cells: list[Text] = []
        for key, does in row:
            cells += [Text(key, style="bold white on red" if key == "SPACE" else "bold"), Text(does)]
        table.add_row(*cells)
    return table
