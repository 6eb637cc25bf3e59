"""Cost of a step of the cell, with parts at rest and awake.

Small parts of four kinds lie in the bins. The belt and the arm stand still, without subscribers. Parts at rest sleep.
"Awake" is the same cell without the engine's sleeping: nothing moves there either, but everything is computed.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.timing import best_in_turn, processor_time
from cellwright.cell.cell import Cell
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose

TYPES = ("gear_part", "disk_part", "part4", "part2")
"""Small enough for a narrow grid; larger parts jam there, and jammed parts do not sleep."""
STEPS = 2000
REPEATS = 3


def trial_with(count: int) -> Trial:
    """Return a trial with an arm and `count` parts of all kinds in its bins."""
    parts = []
    for number in range(count):
        x, y = gear2017().bins[number % 8].centre
        row, column = divmod(number // 8, 4)
        place = (x - 0.2 + 0.14 * column, y - 0.2 + 0.13 * row, gear2017().bins[0].grid_height)
        kind = TYPES[number % len(TYPES)]
        parts.append(Part(f"bin|{kind}_{number + 1}", kind, Pose(place)))
    return Trial("bench", has_arm=True, bin_parts=tuple(parts))


def microseconds(cell: Cell, repeats: int, steps: int) -> float:
    """Return the least time of a step [us] over the repeats."""

    def step() -> None:
        for _ in range(steps):
            cell.step()

    def once() -> float:
        cell.reset()
        cell.simulation.step_until(10**9)
        return processor_time(step)

    return best_in_turn(repeats, once)[0] / steps * 1e6


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Time steps with an increasing number of parts."""
    repeats, steps = (1, 20) if quick else (REPEATS, STEPS)
    alone = 0.0
    for count in (0, 60) if quick else (0, 20, 60, 100):
        on_progress(f"{count} parts")
        cell = Cell(trial_with(count))
        rest = microseconds(cell, repeats, steps)
        alone = alone or rest
        cell.simulation.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        awake = microseconds(cell, repeats, steps)
        yield Figure(f"{count} parts at rest", rest, "us/step")
        if count:
            yield Figure(f"{count} parts at rest / arm only", rest / alone, maximum=2.5 if count == 60 else None)
        yield Figure(f"{count} parts awake", awake, "us/step")
