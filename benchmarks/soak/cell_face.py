"""A kit-building cell for long runs.

In each shift the arm carries a rod from a bin to a tray, both AGVs drive off and come back, and parts ride the belt to
its end. Then the cell rests for a while. Parts that have left are put back in: no trial's pool of parts would last.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable

from benchmarks.soak.face import ROUND, MessageCounter
from cellwright.cell.cell import Cell
from cellwright.cell.devices.grippers import Gripper
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import BeltPart, Kit, KitObject, Order, Part, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.util.pose import Pose

LAYOUT = gear2017()
ROD = Part(
    "bin7|piston_rod_part_1",
    "piston_rod_part",
    Pose.from_rpy((-0.3, 0.03, LAYOUT.bins[0].grid_height), (0.0, 0.0, math.pi / 4)),
)
RIDERS = ("gear_part", "disk_part", "part4")
"""Types of the parts on the belt, one after the other; each is gone before its turn comes again."""

SHIFT = 4
"""Rounds from one shift to the next: one of work, the others of rest."""

KITS = tuple(Kit(f"order_0_kit_{number}", (KitObject(ROD.type, Pose()),)) for number in range(2))
"""Only the first is ever sent, so that the order stays open."""

SENSORS = (
    SensorConfig("break_beam_1", "break_beam", Pose.from_rpy((1.6, 2.25, 0.91), (0.0, 0.0, math.pi))),
    SensorConfig("proximity_sensor_1", "proximity_sensor", Pose((0.95, 2.6, 0.92))),
    SensorConfig("logical_camera_1", "logical_camera", Pose.from_rpy((-0.3, 0.23, 1.4), (0.0, math.pi / 2, 0.0))),
    SensorConfig(
        "laser_profiler_1", "laser_profiler", Pose.from_rpy((1.21, 4.0, 1.64), (-math.pi, math.pi / 2, math.pi / 2))
    ),
)
HEARD = ("/ariac/break_beam_1_change", "/ariac/logical_camera_1", "/ariac/gripper/state")
"""Topics of the long listeners, besides those of every client; a short run listens to all."""

TRIAL = Trial(
    "endurance",
    has_arm=True,
    sensors=SENSORS,
    orders=(Order("order_0", KITS, start_time=0.0),),
    bin_parts=(ROD,),
    belt_parts=tuple(BeltPart(30.0 * number, kind, Pose((0.0, 0.0, 0.1))) for number, kind in enumerate(RIDERS)),
    time_limit=None,
)

# elbow, rail, shoulder lift, shoulder pan, wrist 1, 2, 3 [rad; m for the rail]
ABOVE_BIN, ON_PART = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0], [2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0]
BY_AGV, OVER_TRAY = [2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0], [1.02, 2.0, -0.27, 1.5, 4.0, -1.51, 0.0]


class CellFace:
    """The cell and its program; see `Face`.

    Args:
        everything: listen to every topic.
    """

    def __init__(self, *, everything: bool = False) -> None:
        self.cell = Cell(TRIAL, seed=1)
        self.simulation = self.cell.simulation
        self.counts: Counter[str] = Counter()
        self._transport = InProcess(self.cell)
        self._client = Client(self._transport)
        counter = MessageCounter(self.cell.bus, self.counts)
        for topic in self.cell.topics() if everything else HEARD:
            counter.listen(topic)
        if self.cell.gripper is not None:
            self.cell.gripper.on_change.append(self._count_grip)
        self._riders = [name for name, _ in self.cell.world.clones][: len(RIDERS)]

    def begin(self) -> None:
        """Start the competition."""
        self._client.start_competition()

    def work(self, number: int) -> None:
        """Run a round."""
        begin = number * ROUND
        if number % SHIFT == 0:
            for when, act in self._plan(number // SHIFT):
                self._transport.advance(begin + nanoseconds(when))
                act()
        self._transport.advance(begin + ROUND)

    def _plan(self, shift: int) -> list[tuple[float, Callable[[], object]]]:
        """Return the actions of a shift with their times [s]."""
        client = self._client
        return [
            (0.1, self._put_rod_back),
            (0.2, lambda: self._ride(2 * shift)),
            (0.3, lambda: self._send(2, KITS[0].kit_type)),
            (1.0, lambda: client.control_gripper(True)),
            (1.0, lambda: client.send_arm([ABOVE_BIN, ON_PART], times=[2.0, 3.0])),
            (6.0, lambda: client.send_arm([ABOVE_BIN, BY_AGV, OVER_TRAY], times=[1.0, 3.0, 4.0])),
            (12.0, lambda: client.control_gripper(False)),
            (13.0, lambda: client.send_arm([BY_AGV, ABOVE_BIN], times=[1.0, 3.0])),
            (14.0, lambda: self._send(1, KITS[0].kit_type)),
            (18.2, lambda: self._ride(2 * shift + 1)),
        ]

    def _put_rod_back(self) -> None:
        self.cell.parts.place(self.cell.parts.part(ROD.name), ROD.pose)

    def _ride(self, turn: int) -> None:
        self.cell.parts.appear(self._riders[turn % len(self._riders)], LAYOUT.belts[0].spawn @ Pose((0.0, 0.0, 0.1)))
        self.counts["parts put on the belt"] += 1

    def _send(self, number: int, kit_type: str) -> None:
        self.counts["AGVs sent"] += self._client.control_agv(number, kit_type)

    def _count_grip(self, gripper: Gripper) -> None:
        self.counts["parts gripped"] += gripper.attached
