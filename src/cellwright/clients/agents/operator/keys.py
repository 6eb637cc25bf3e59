"""Keys of a terminal for the arms of a cell: they publish to the agent `operator`, as the keys of its page do.

A terminal knows presses alone. Each is a velocity that the agent ends after a quarter of a second, and a held key
repeats its press.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from cellwright.clients.agents.operator.requests import COMMAND, REPORT, VELOCITY, velocity_request
from cellwright.clients.client.client import Client
from cellwright.clients.operators.keyboard import POLL_INTERVAL, POLLS_PER_REDRAW, KeyDecoder
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import CellwrightError, UsageError
from cellwright.util.pose import Vector3

SPEED, TURN = 0.1, 0.5
"""Speed of the tool [m/s], and about the vertical [rad/s]."""
FAST = 4.0
"""Factor of a capital letter."""
MOVES: Mapping[str, tuple[int, float]] = {
    "w": (0, 1.0),
    "s": (0, -1.0),
    "a": (1, 1.0),
    "d": (1, -1.0),
    "r": (2, 1.0),
    "f": (2, -1.0),
    "q": (5, 1.0),
    "e": (5, -1.0),
}
"""Axis and sign of each key: along x, y, z and about z."""
SAYS: Mapping[str, str] = {" ": "stop", "c": "clear", "h": "home", "x": "snap", "u": "upright on", "n": "upright off"}
"""Command of each key."""
HELP = (
    ("w s  a d  r f", "along x, y, z"),
    ("q e", "turn about the vertical"),
    ("capital", "four times as fast"),
    ("g v", "grip, release"),
    ("x h", "snap to the part below, home"),
    ("u n", "tool upright, or free"),
    ("1 2 …", "choose an arm"),
    ("SPACE", "STOP"),
    ("c", "clear the stop"),
    ("Esc", "quit; the arms stay"),
)
"""Keys, and their actions."""
_FIRST = 2.0  # [s] for the agent's first report


class CellKeys:
    """Works the arms of a cell by keys.

    Args:
        client: client of the cell.

    Raises:
        UsageError: no agent `operator` works the cell.
    """

    def __init__(self, client: Client) -> None:
        self.client = client
        self.message = ""
        """Message to the operator, in a sentence."""
        self._report = client.latest(REPORT)
        self._layout = client.layout()
        self._decoder = KeyDecoder()
        if self._report.wait(_FIRST) is None:
            raise UsageError(
                "no operator works this cell; start it with: cellwright run TRIAL --operator, or let one work a served "
                "cell with: cellwright run --agent operator --connect HOST:PORT"
            )

    @property
    def report(self) -> Mapping[str, Any]:
        """Newest report of the agent."""
        found: Mapping[str, Any] = json.loads(self._report.message.data)
        return found

    def run(self, read: Callable[[], str], draw: Callable[[], None]) -> None:
        """Work until a key quits; `read` returns the text typed since its last call, and never waits."""
        looks = 0
        while self.take(read()):
            if looks % POLLS_PER_REDRAW == 0:
                draw()
            looks += 1
            self.client.sleep(POLL_INTERVAL)

    def take(self, text: str) -> bool:
        """Handle typed text; False when it quits."""
        keys = self._decoder.feed(text)
        if " " in keys:  # keys typed before the stop are dropped
            keys = keys[keys.index(" ") :]
        moved: set[str] = set()
        for key in keys:
            if key in ("escape", "ctrl-c"):
                return False
            if key.lower() in MOVES and key in moved:
                continue  # a held key repeats its press
            moved.add(key)
            try:
                self._press(key)
            except CellwrightError as error:  # refused
                self.message = str(error)
        return True

    def _press(self, key: str) -> None:
        if key.lower() in MOVES:
            self.client.publish(VELOCITY, velocity_request(*_velocity(key)))
        elif key in SAYS:
            self._say(SAYS[key])
        elif key in "gv":
            self._grip(enable=key == "g")
        elif key.isdigit() and 0 < int(key) <= len(names := list(self.report["arms"])):
            self._say(f"arm {names[int(key) - 1]}")

    def _say(self, command: str) -> None:
        self.message = command
        self.client.publish(COMMAND, String(command))

    def _grip(self, *, enable: bool) -> None:
        chosen = self.report["arm"]
        arm = next((each for each in self._layout.arms if each.name == chosen), None)
        if arm is None or arm.tool.kind == "none":
            self.message = f"{chosen} has no gripper of its cell"
            return
        (self.client.arm(arm.namespace) if arm.namespace else self.client).control_gripper(enable)
        self.message = "grip" if enable else "release"


def _velocity(key: str) -> tuple[Vector3, Vector3]:
    """Return the velocity of the tool that a key asks for [m/s, rad/s]."""
    axis, sign = MOVES[key.lower()]
    share = sign * (FAST if key.isupper() else 1.0)
    values = [0.0] * 6
    values[axis] = share * (TURN if axis > 2 else SPEED)
    x, y, z, a, b, c = values
    return (x, y, z), (a, b, c)
