"""What a step costs: parts at rest and awake, and the share of the engine in a whole run.

Run with `python benchmarks/step_cost.py`. Every figure is taken in one process, the repeats in turn, the best counted;
read them as ratios.
"""

from __future__ import annotations

import time

import mujoco

from cellwright.agents.agent import Agent
from cellwright.agents.kitter.agent import KitterAgent
from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.description.layout import BIN_CENTRES, BIN_PART_HEIGHT
from cellwright.description.trial import Part, Trial
from cellwright.pose import Pose
from cellwright.run import run_cell

TYPES = ("gear_part", "disk_part", "part4", "part2")
"""Small enough for a narrow grid; larger parts jam there, and what is jammed does not sleep."""
STEPS = 2000
REPEATS = 3


def trial_with(count: int) -> Trial:
    """A cell with an arm and `count` parts of all kinds in its bins."""
    parts = []
    for number in range(count):
        x, y = list(BIN_CENTRES.values())[number % 8]
        row, column = divmod(number // 8, 4)
        place = (x - 0.2 + 0.14 * column, y - 0.2 + 0.13 * row, BIN_PART_HEIGHT)
        kind = TYPES[number % len(TYPES)]
        parts.append(Part(f"bin|{kind}_{number + 1}", kind, Pose(place)))
    return Trial("bench", has_arm=True, bin_parts=tuple(parts))


def microseconds(cell: Cell) -> float:
    """The least time of a step [us] over the repeats."""
    best = float("inf")
    for _ in range(REPEATS):
        cell.reset()
        cell.simulation.step_until(10**9)
        begin = time.process_time()
        for _ in range(STEPS):
            cell.step()
        best = min(best, time.process_time() - begin)
    return best / STEPS * 1e6


def main() -> None:
    """Print the tables."""
    print("parts   at rest [us/step]   awake [us/step]")
    for count in (0, 20, 60, 100):
        cell = Cell(trial_with(count))
        rest = microseconds(cell)
        cell.simulation.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        awake = microseconds(cell)
        print(f"{count:5d}   {rest:17.1f}   {awake:15.1f}")
    for files, agent in (
        (["lesson"], None),
        (["lesson"], KitterAgent()),
        (["final04", "kitter_sensors"], KitterAgent()),
    ):
        ratio, factor = share(files, agent)
        who = "nobody" if agent is None else "kitter"
        print(f"{files[0]}, worked by {who}: wall time {ratio:.3f} x time in mj_step, {factor:.0f} x real time")


def share(files: list[str], agent: Agent | None) -> tuple[float, float]:
    """Wall time over time in mj_step of a whole run, and its real-time factor."""
    cell = Cell(load_trial([find_trial(file) for file in files]).trial)
    inside = 0.0
    step = mujoco.mj_step

    def timed(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        nonlocal inside
        begin = time.perf_counter()
        step(model, data)
        inside += time.perf_counter() - begin

    mujoco.mj_step = timed
    try:
        begin = time.perf_counter()
        if agent is not None:
            run_cell(cell, agent)
        else:
            cell.competition.start()
            cell.simulation.step_until(80 * 10**9)
        wall = time.perf_counter() - begin
    finally:
        mujoco.mj_step = step
    return wall / inside, cell.simulation.time / wall


if __name__ == "__main__":
    main()
