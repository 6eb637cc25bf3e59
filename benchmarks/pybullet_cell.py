"""Speed of the whole cell compared with PyBullet, and agreement of both simulations.

Both make equally many steps in turn, and the best of the repeats counts. Ours is the whole product, without
subscribers. PyBullet only steps and drives the arm, sampled from the same trajectory; the time of this sampling counts
for both. Shapes, masses, gravity, friction and the belt's speed are the same in both. Everything else of PyBullet is
its default.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import TypeAlias

import mujoco
import numpy as np

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.busy_cell import BELT_PARTS, ON_BELT, busy_cell
from benchmarks.pybullet_twin import PyBulletTwin
from cellwright.cell.cell import Cell

FEW, MANY = 20, 60
"""Parts in bins."""
RATES = (240, 500)
"""Steps per second [Hz]: PyBullet's default and ours."""
MIN_RATIO, MIN_DEFAULT_RATIO = 12.0, 28.0
"""Goals of PyBullet's time to that of the cell with many parts: with its parts asleep, and by default."""
WARM_UP, WINDOW, REPEATS = 3, 2, 3  # [s], [s]; PyBullet's parts fall asleep after two seconds


class CellSide:
    """The cell, stepped as a program steps it."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell

    def run(self, steps: int) -> None:
        """Take some steps."""
        for _ in range(steps):
            self.cell.step()


class TwinSide:
    """Its twin in PyBullet, whose arm follows the same trajectory."""

    def __init__(self, cell: Cell, *, sleeping: bool) -> None:
        assert cell.arm is not None
        self.twin = PyBulletTwin(cell, sleeping=sleeping)
        self._controller, self._clock, self._tick = cell.arm.controller, cell.simulation.clock, 0

    def run(self, steps: int) -> None:
        """Take some steps."""
        for _ in range(steps):
            self._tick += 1
            now = self._clock.time_of(self._tick)
            self.twin.step(self._controller.positions(now), self._controller.velocities(now))

    def close(self) -> None:
        """Release PyBullet's world."""
        self.twin.close()


Side: TypeAlias = CellSide | TwinSide


@dataclass(frozen=True)
class Agreement:
    """Difference of both engines, and from the commands.

    Attributes:
        resting: of the parts in bins, the largest distance between the engines [mm].
        belt: largest deviation from the belt's speed of what rides on it, ours and PyBullet's [%].
        arm: largest error of a joint of the arm, ours and PyBullet's [mrad; mm for the rail].
    """

    resting: float
    belt: tuple[float, float]
    arm: tuple[float, float]


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Time both; then compare their states."""
    repeats = 1 if quick else REPEATS
    for rate in RATES:
        on_progress(f"{FEW} parts, {rate} Hz")
        yield from _with_few(rate, repeats)
        on_progress(f"{MANY} parts, {rate} Hz")
        yield from _with_many(rate, repeats)


def _with_few(rate: int, repeats: int) -> Iterator[Figure]:
    with ExitStack() as stack:
        ours, theirs = pair(FEW, rate, repeats, stack, sleeping=(True, False))
        own, asleep, awake = min_times([ours, *theirs], rate, repeats)
    label = f"{FEW} parts, {rate} Hz"
    yield Figure(f"{label}: speed / PyBullet with sleep", asleep / own)
    yield Figure(f"{label}: speed / PyBullet by default, without sleep", awake / own)


def _with_many(rate: int, repeats: int) -> Iterator[Figure]:
    label = f"{MANY} parts, {rate} Hz"
    with ExitStack() as stack:
        ours, (theirs, by_default) = pair(MANY, rate, repeats, stack, sleeping=(True, False))
        still, twins = pair(MANY, rate, repeats, stack, sleeping=(True,), riding=0)
        awake = CellSide(busy_cell(MANY, rate, _seconds(repeats)))
        awake.cell.simulation.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        times = min_times([ours, theirs, by_default, still, *twins, awake], rate, repeats)
        own, other, restless, own_resting, other_resting, own_restless = times
        shares = (
            f"of a step the {BELT_PARTS} parts on the belt, awake in both engines, take {own - own_resting:.0f} of our "
            f"{own:.0f} us, and {other - other_resting:.0f} of PyBullet's {other:.0f} us"
        )
        yield Figure(f"{label}: ours", 1e6 / own / rate, "x real time")
        yield Figure(f"{label}: speed / PyBullet with sleep", other / own, minimum=MIN_RATIO, note=shares)
        default_note = f"our parts sleep by default; PyBullet takes {restless:.0f} us for a step, with all parts awake"
        yield Figure(
            f"{label}: speed / PyBullet by default, without sleep",
            restless / own,
            minimum=MIN_DEFAULT_RATIO,
            note=default_note,
        )
        yield Figure(f"{label}: speed / PyBullet with sleep, empty belt", other_resting / own_resting)
        yield Figure(f"{label}: speed / PyBullet, both without sleep", restless / own_restless)
        difference = agreement(ours, theirs, rate)
    yield Figure(
        f"{label}: distance of a resting part from its place in PyBullet", difference.resting, "mm", maximum=1.0
    )
    for who, belt, arm in zip(("ours", "PyBullet"), difference.belt, difference.arm, strict=True):
        yield Figure(f"{label}: speed error of parts on the belt, {who}", belt, "%", maximum=0.5)
        yield Figure(f"{label}: path error of a joint of the arm, {who}", arm, "mrad", maximum=20.0)


def pair(
    count: int, rate: int, repeats: int, stack: ExitStack, *, sleeping: Sequence[bool], riding: int = BELT_PARTS
) -> tuple[CellSide, list[TwinSide]]:
    """Return a busy cell at its first step, and a twin of it for each of `sleeping`; the stack closes them."""
    cell = busy_cell(count, rate, _seconds(repeats), riding)
    twins = [stack.enter_context(closing(TwinSide(cell, sleeping=asleep))) for asleep in sleeping]
    return CellSide(cell), twins


def min_times(sides: Sequence[Side], rate: int, repeats: int) -> list[float]:
    """Return the least time of a step [us] of each over the repeats, once resting parts have fallen asleep."""
    for side in sides:
        side.run(WARM_UP * rate)
    best = [float("inf")] * len(sides)
    for _ in range(repeats):
        for number, side in enumerate(sides):
            begin = time.process_time()
            side.run(WINDOW * rate)
            best[number] = min(best[number], time.process_time() - begin)
    return [each / (WINDOW * rate) * 1e6 for each in best]


def agreement(ours: CellSide, theirs: TwinSide, steps: int) -> Agreement:
    """Return the agreement of both over the next `steps`, after equally many."""
    cell, twin = ours.cell, theirs.twin
    assert cell.arm is not None
    names = [part.name for part in cell.world.parts]
    riding = np.array([name.startswith(ON_BELT) for name in names])
    arm = [0.0, 0.0]
    early = cell.parts.positions(), np.array([twin.pose(name).position for name in names])
    for _ in range(steps):
        ours.run(1)
        theirs.run(1)
        targets = np.array(cell.arm.controller.positions(cell.simulation.now))
        for side, joints in enumerate((cell.arm.read().positions, twin.joint_positions())):
            arm[side] = max(arm[side], float(np.abs(joints - targets).max()) * 1e3)
    late = cell.parts.positions(), np.array([twin.pose(name).position for name in names])
    seconds, speed = steps * cell.simulation.model.opt.timestep, cell.conveyors["belt"].speed
    off = [(late[side] - early[side])[riding] / seconds + (0.0, speed, 0.0) for side in (0, 1)]
    belt = [float(np.linalg.norm(each, axis=1).max(initial=0.0)) / speed * 100 for each in off]
    apart = np.linalg.norm(late[0] - late[1], axis=1)[~riding]
    return Agreement(float(apart.max(initial=0.0)) * 1e3, (belt[0], belt[1]), (arm[0], arm[1]))


def _seconds(repeats: int) -> int:
    """Return the duration of the arm's swings: that of all measurements [s]."""
    return WARM_UP + repeats * WINDOW + 2
