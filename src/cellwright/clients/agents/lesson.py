"""Agent of the lesson: scripted joint waypoints, no planning, and one sensor.

Waypoints, pauses and decisions are those of ROS Developers Live Class 20, "Simulate an industrial environment". The
printed text had lost where the arm is sent in between; its comments and its prose restored that. The agent ignores
the orders: it puts two piston rods from bin 7 at one place of AGV 1's tray. Then it waits by the belt for two gears,
and sends the kit.
"""

import logging
from collections.abc import Sequence
from typing import Any

from cellwright.clients.client.client import Client

log = logging.getLogger(__name__)

READY, PICK, LIFT, TO_AGV, PLACE, RETRACT, TO_BIN, BY_BELT, _ABOVE_BELT, ON_BELT, OFF_BELT = range(11)

# elbow, rail, shoulder lift, shoulder pan, wrist 1, wrist 2, wrist 3 [rad; m]; an eighth number, as joint states have
# it, belongs to no joint of the controller, which ignores it
WAYPOINTS: tuple[tuple[float, ...], ...] = (
    (2.5, 0.0, -1.2, 3.20, 3.5, -1.51, 0.0, 0.0),  # ready
    (2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0, 0.0),  # at the first piston rod of bin 7
    (2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0),  # lifted
    (2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0, 0.0),  # beside AGV 1
    (1.02, 2.0, -0.27, 1.5, 4.0, -1.51, 0.0, 0.0),  # over its tray
    (2.6, 2.0, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0),  # drawn back
    (2.6, 0.38, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0),  # above the bin again
    (2.7, 1.88, -1.5, 0.0, 3.5, -1.51, 0.0, 0.0),  # by the belt
    (1.7, 1.84, -0.8, 0.0, 3.7, -1.57, 0.0, 0.0),  # a correction that the script does not use
    (1.65, 1.84, -0.7, 0.0, 3.7, -1.57, 0.0, 0.0),  # on the belt
    (2.7, 1.84, -1.5, 1.5, 3.5, -1.51, 0.0, 0.0),  # off the belt
)

RAIL, SHOULDER_LIFT, SHOULDER_PAN = 1, 2, 3
STEP = 0.13
"""Distance between neighbouring parts along the rail [m], and angle between places on the tray [rad]."""


class LessonAgent:
    """The script as a program.

    Args:
        from_bin: fetch parts from the bin, all of them in the first turn.
        from_belt: fetch parts from the belt, one a turn when the beam is broken at that moment.
        parts: number of parts from either.
        timeout: time [s] without a broken beam after which it sends the kit as it is. The script itself has no end
            there: it looks once a second, and gears come every six, so it would look at the wrong moment forever.
    """

    def __init__(self, *, from_bin: bool = True, from_belt: bool = True, parts: int = 2, timeout: float = 60.0) -> None:
        self.from_bin = from_bin
        self.from_belt = from_belt
        self.parts = parts
        self.timeout = timeout
        self.count = 0
        self.by_belt = False
        self.beam_broken = False
        self.last_seen = 0.0

    def run(self, client: Client) -> None:
        """Start the competition, then look for work once a second until the kit is sent."""
        client.on_sensor("break_beam", self._take_beam)
        client.start_competition()
        self._send(client, READY)
        client.sleep(1.5)
        rate = client.rate(1.0)
        self.last_seen = client.time
        while not self._work(client) and client.time - self.last_seen < self.timeout:
            rate.sleep()
        log.info("work completed, with %d of %d parts from the belt", self.count, self.parts)
        self._send(client, READY)
        client.sleep(1.0)
        client.control_agv(1, "order_0_kit_0")

    def _take_beam(self, message: Any) -> None:
        self.beam_broken = message.object_detected

    def _work(self, client: Client) -> bool:
        """Run one turn of the script's loop; return True when the work is done."""
        if self.from_bin:
            for number in range(self.parts):
                self._fetch_from_bin(client, number)
        if self.from_belt:
            self.from_bin = False
            self._fetch_from_belt(client)
        return self.count == self.parts or self.from_bin

    def _fetch_from_bin(self, client: Client, number: int) -> None:
        _set_status(client, "fetching piston rod %d from the bin", number + 1)
        self._send(client, changed(PICK, RAIL, WAYPOINTS[PICK][RAIL] + STEP * number))
        client.sleep(1.0)
        client.control_gripper(True)
        client.sleep(0.2)
        log.info("delivering it (%s)", "held" if client.gripper_attached else "the cup is empty")
        self._send(client, LIFT, TO_AGV, PLACE)
        client.sleep(3.0)
        client.control_gripper(False)
        client.sleep(0.2)
        self._send(client, RETRACT)
        client.sleep(1.0)
        self._send(client, TO_BIN)
        client.sleep(1.0)

    def _fetch_from_belt(self, client: Client) -> None:
        if not self.by_belt:
            _set_status(client, "taking up position by the belt")
            self._send(client, BY_BELT)
            client.sleep(1.5)
            self.by_belt = True
            self.last_seen = client.time
        if not self.beam_broken:
            return
        self.last_seen = client.time
        _set_status(client, "the beam is broken: lowering")
        client.sleep(0.3)
        client.control_gripper(True)
        self._send(client, changed(ON_BELT, SHOULDER_LIFT, -0.66))
        client.sleep(1.2)
        if not self._holds(client):
            return
        self._send(client, OFF_BELT)
        client.sleep(1.0)
        if not self._holds(client):
            return
        _set_status(client, "delivering gear %d", self.count + 1)
        self._send(client, changed(PLACE, SHOULDER_PAN, 1.65 - self.count * STEP))
        client.sleep(1.5)
        client.control_gripper(False)
        client.sleep(0.2)
        self._send(client, BY_BELT)
        client.sleep(1.0)
        self.count += 1

    def _holds(self, client: Client) -> bool:
        """Return whether the cup holds something; if not, the arm goes back to wait for the next part."""
        if client.gripper_attached:
            return True
        _set_status(client, "the cup is empty: going back")
        self._send(client, BY_BELT)
        client.sleep(0.5)
        return False

    def _send(self, client: Client, *waypoints: int | Sequence[float]) -> None:
        """Send the arm along waypoints, given by number or by value, one second each."""
        client.send_arm([WAYPOINTS[each] if isinstance(each, int) else each for each in waypoints])


def changed(waypoint: int, joint: int, value: float) -> tuple[float, ...]:
    """Return a waypoint with one joint at another position [rad; m for the rail]."""
    positions = list(WAYPOINTS[waypoint])
    positions[joint] = value
    return tuple(positions)


def _set_status(client: Client, text: str, *arguments: Any) -> None:
    """Announce the next action, in the log and in the viewer."""
    log.info(text, *arguments)
    client.set_status(text % arguments)
