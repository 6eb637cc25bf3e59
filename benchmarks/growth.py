"""Growth of a step's cost, and of memory, with the number of parts.

The cell is at work: its belt runs, and its arm swings over the bins. Parts at rest sleep, spread over the bins and four
tables, with equal shares at each number. Parts that ride are half a metre apart, with 60 parts at rest. All cells make
their steps in turn without subscribers, and the best processor time of each counts.

A bound says that nothing grows faster than linearly. The cost at the largest number is compared with a straight line
through those at none and at half the largest. Memory is that of a new process after a second of simulation. The
engine's arena holds contacts and constraints; it reserves more addresses than it uses memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from benchmarks.benchmarks import Curve, Figure, OnProgress
from benchmarks.busy_cell import at_work, on_belt
from benchmarks.checkout import OURS, Checkout
from benchmarks.step import TYPES
from benchmarks.timing import best_in_turn, processor_time
from cellwright.cell.cell import Cell
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.models.model import Furniture, ModelShape, UserModel
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose

RESTING, RIDING = (0, 50, 100, 200, 400), (0, 2, 4, 8, 16)
"""Numbers of parts at rest, and of parts that ride on the belt."""
BESIDE = 60
"""Parts at rest in the cell of those that ride."""
WARM_UP, WINDOW, REPEATS = 1500, 500, 6
"""Steps until parts at rest sleep, steps of a measurement, and measurements."""
MAX_BEND, MAX_AT_REST = 1.2, 2.0
"""Required straightness of each curve, and the largest cost with 400 parts at rest compared with none."""

_BETWEEN = 0.5  # parts on the belt [m]
_DROP = 0.0005  # initial height of parts above their surface [m]
_PITCH = (0.14, 0.13)  # of the grid that parts lie on [m]
_TABLE = (1.2, 1.8, 0.05)  # [m]
_TABLES = [(x, y) for x in (-4.2, -2.8) for y in (-1.0, 1.0)]  # middles [m]: beyond the bins, seen from the arm
MEMORY = """
import json, sys
from benchmarks.growth import grown_cell, run
from benchmarks.soak.memory import MEBIBYTE, resident
cell = grown_cell(int(sys.argv[1]), 0, 2)
run(cell, int(sys.argv[2]))
data = cell.simulation.data
print(json.dumps([resident(), data.maxuse_arena / MEBIBYTE, data.narena / MEBIBYTE]))
"""
"""Prints the resident memory of a process with a cell, and its arena's use and size [MiB]."""


def resting_parts(count: int) -> tuple[Part, ...]:
    """Return parts, at most 400, with equal shares in all bins and on all tables."""
    places = [
        (x + _PITCH[0] * (column - (columns - 1) / 2), y + _PITCH[1] * (row - (rows - 1) / 2))
        for middles, columns, rows in (([each.centre for each in gear2017().bins], 4, 4), (_TABLES, 7, 10))
        for x, y in middles
        for row in range(rows)
        for column in range(columns)
    ]
    chosen = [places[number * max(RESTING) // count] for number in range(count)]
    return tuple(
        Part(f"bin|{kind}_{number + 1}", kind, Pose((x, y, gear2017().bins[0].surface + _DROP)))
        for number, (x, y) in enumerate(chosen)
        for kind in (TYPES[number % len(TYPES)],)
    )


def grown_cell(resting: int, riding: int, seconds: int) -> Cell:
    """Return a cell at work with parts at rest and parts that ride; its arm swings for some seconds."""
    plate = UserModel((ModelShape("box", _TABLE),))
    tables = tuple(
        Furniture(f"table_{number + 1}", plate, Pose((x, y, gear2017().bins[0].surface - _TABLE[2] / 2)))
        for number, (x, y) in enumerate(_TABLES)
    )
    parts = (*resting_parts(resting), *on_belt(riding, _BETWEEN))
    return at_work(Trial("growth", has_arm=True, bin_parts=parts, furniture=tables), seconds)


def run(cell: Cell, steps: int) -> None:
    """Take some steps."""
    for _ in range(steps):
        cell.step()


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure | Curve]:
    """Time cells of rising size in turn, then weigh them."""
    resting, riding = (RESTING[::2], RIDING[::2]) if quick else (RESTING, RIDING)
    on_progress(f"{', '.join(map(str, resting))} parts at rest")
    at_rest = _step_curve("step, parts at rest", [(count, 0) for count in resting], resting, quick=quick)
    yield at_rest
    yield from at_rest.figures(MAX_BEND)
    yield Figure(f"{max(RESTING)} parts at rest / arm only", at_rest.costs[-1] / at_rest.costs[0], maximum=MAX_AT_REST)
    on_progress(f"{', '.join(map(str, riding))} parts on the belt")
    on_the_belt = _step_curve("step, parts on the belt", [(BESIDE, count) for count in riding], riding, quick=quick)
    yield on_the_belt
    yield from on_the_belt.figures(MAX_BEND)
    on_progress("memory")
    checkout, steps = Checkout(OURS), "10" if quick else "500"
    weighed = [checkout.run(MEMORY, str(count), steps) for count in resting]
    resident, used, reserved = zip(*weighed, strict=True)
    memory = Curve("resident memory", "part", "MiB", resting, resident)
    yield memory
    yield from memory.figures(MAX_BEND)
    note = f"the engine reserves {reserved[-1]:.0f} MiB of addresses"
    yield Figure("the engine's arena, largest use: 0 parts", used[0], "MiB")
    yield Figure(f"the engine's arena, largest use: {resting[-1]} parts", used[-1], "MiB", note=note)
    arena = Curve("the engine's arena", "part", "MiB", resting, used)
    yield Figure("the engine's arena: the last / a straight line", arena.bend, maximum=MAX_BEND)


def _step_curve(title: str, cells: list[tuple[int, int]], sizes: tuple[int, ...], *, quick: bool) -> Curve:
    """Return the cost of a step of cells, by their numbers of parts at rest and on the belt."""
    warm_up, window, repeats = (50, 20, 1) if quick else (WARM_UP, WINDOW, REPEATS)
    made = [grown_cell(*counts, seconds=(warm_up + repeats * window) // 500 + 2) for counts in cells]
    for cell in made:
        run(cell, warm_up)
    times = best_in_turn(repeats, *(partial(processor_time, partial(run, cell, window)) for cell in made))
    return Curve(title, "part", "us/step", sizes, tuple(each / window * 1e6 for each in times))
