"""Growth of a step's cost with the numbers of bins, belts and AGVs of a cell, and the cost of a large cell.

Each cell is at work: its belts run in turn one way and the other, eight parts ride on each, and the arms swing over the
bins. Sixteen parts lie in each bin and sleep. All cells make their steps in turn without subscribers, and the best
processor time of each counts. The large cell has the most of everything but arms. A cell with two arms, on either
side of the bins, is timed beside that with one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from benchmarks.benchmarks import Curve, Figure, OnProgress
from benchmarks.busy_cell import swings
from benchmarks.growth import run
from benchmarks.step import TYPES
from benchmarks.timing import best_in_turn, processor_time
from cellwright.cell.cell import Cell
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Belt, Bin, Carrier, Layout
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose

BINS, BELTS, CARRIERS = (0, 8, 16, 24), (0, 1, 2, 3), (0, 1, 2, 4)
"""Numbers of each, with those of 2017 of the others."""
IN_EACH_BIN, ON_EACH_BELT = 16, 8
"""Parts at rest in a bin, and parts that ride on a belt."""
WARM_UP, WINDOW, REPEATS = 1500, 500, 6
"""Steps until parts at rest sleep, steps of a measurement, and measurements."""
MAX_BEND = 1.2
"""Required straightness of each curve."""
MAX_SECOND_ARM = 1.6
"""Bound of a step with two arms, by one with a single arm."""

_DROP = 0.0005  # initial height of parts above their surface [m]
_PITCH = (0.14, 0.13)  # of the grid of parts in a bin [m]
_ROWS = 0.75  # distance of the rows of bins, and of the AGVs behind each other [m]
_BESIDE = 1.0  # distance of belts [m]
_BETWEEN = 1.0  # distance of parts on a belt [m]
_BEHIND = -2.6  # x of the second arm, on the far side of the bins [m]


class Size(NamedTuple):
    """Numbers of bins, belts, AGVs and arms of a cell."""

    bins: int = 8
    belts: int = 1
    carriers: int = 2
    arms: int = 1


LARGE = Size(BINS[-1], BELTS[-1], CARRIERS[-1])


def layout(size: Size) -> Layout:
    """Return the layout of 2017 with other numbers of bins, belts, AGVs and arms."""
    base = gear2017()
    return replace(
        base,
        bins=tuple(_bin(base.bins[number % 4], number) for number in range(size.bins)),
        belts=tuple(_belt(base.belts[0], number) for number in range(size.belts)),
        carriers=tuple(_carrier(base.carriers[number % 2], number) for number in range(size.carriers)),
        arms=base.arms if size.arms == 1 else tuple(_arm(base.arms[0], number) for number in range(size.arms)),
    )


def _bin(like: Bin, number: int) -> Bin:
    """Return a bin in a column of four; columns are filled away from the arm."""
    shift = Pose((0.7 - _ROWS * (number // 4), 0.0, 0.0))
    return replace(like, name=f"bin{number + 1}", pose=shift @ like.pose, link=shift @ like.link)


def _belt(like: Belt, number: int) -> Belt:
    """Return a belt beside the last one, in the opposite direction."""
    if number == 0:
        return like
    x, y, _ = like.centre.position
    beside = Pose((x + _BESIDE * number, y, 0.0)) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi * (number % 2)))
    by = beside @ Pose((-x, -y, 0.0))
    moved = replace(gear2017(), belts=(like,)).moved(by).belts[0]
    return replace(moved, name=f"belt{number + 1}", body=f"conveyor_belt{number + 1}")


def _carrier(like: Carrier, number: int) -> Carrier:
    """Return an AGV behind the last one at the same end of the rail."""
    if number < 2:
        return like
    by = Pose((-2.0 * (number // 2), 0.0, 0.0))
    moved = replace(gear2017(), carriers=(like,)).moved(by).carriers[0]
    name, tray = f"agv{number + 1}", f"kit_tray_{number + 1}"
    return replace(moved, number=number + 1, name=name, tray_link=f"{name}::{tray}::{tray}::tray")


def _arm(like: Arm, number: int) -> Arm:
    """Return one of two arms, which stand on either side of the bins."""
    height = like.pose.position[2]
    pose = like.pose if number == 0 else Pose.from_rpy((_BEHIND, 0.0, height), (0.0, 0.0, math.pi))
    name = f"arm{number + 1}"
    return replace(like, name=name, namespace=name, mount=replace(like.mount, pose=pose))


def parts(of: Layout) -> tuple[Part, ...]:
    """Return sixteen parts in each bin, and eight in a row on each belt."""
    places = [
        Pose((x + _PITCH[0] * (number % 4 - 1.5), y + _PITCH[1] * (number // 4 - 1.5), each.surface + _DROP))
        for each in of.bins
        for x, y in (each.centre,)
        for number in range(IN_EACH_BIN)
    ]
    places += [
        each.centre @ Pose((_BETWEEN * (number - ON_EACH_BELT / 2 - 2.0), 0.0, each.size[2] / 2 + _DROP))
        for each in of.belts
        for number in range(ON_EACH_BELT)
    ]
    kinds = [TYPES[number % len(TYPES)] for number in range(len(places))]
    return tuple(
        Part(f"part|{kind}_{number}", kind, place)
        for number, (kind, place) in enumerate(zip(kinds, places, strict=True), 1)
    )


def cell_of(size: Size, seconds: int) -> Cell:
    """Return a cell at its first step, its belts running and its arms swinging for some seconds."""
    found = layout(size)
    cell = Cell(Trial("layouts", has_arm=True, bin_parts=parts(found), layout=found), servo="precise")
    for conveyor in cell.conveyors.values():
        conveyor.set_power(100.0)
    for arm in cell.arms.values():
        arm.command(swings(seconds))
    return cell


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure | Curve]:
    """Time cells of rising size in turn, then the large one beside that of 2017."""
    for title, name, numbers in (
        ("step, bins of 16 parts", "bin", BINS),
        ("step, belts of 8 parts", "belt", BELTS),
        ("step, AGVs", "AGV", CARRIERS),
    ):
        on_progress(f"{', '.join(map(str, numbers))} {name}s")
        field = "carriers" if name == "AGV" else f"{name}s"
        costs = _costs([Size()._replace(**{field: number}) for number in numbers], quick=quick)
        curve = Curve(title, name, "us/step", numbers, costs)
        yield curve
        yield from curve.figures(MAX_BEND)
    on_progress("one arm and two")
    one, two = _costs([Size(), Size(arms=2)], quick=quick)
    count = len(parts(layout(Size())))
    yield Figure(f"step, two arms, {count} parts", two, "us/step")
    yield Figure("two arms / one", two / one, maximum=MAX_SECOND_ARM)
    on_progress("the large cell")
    small, large = _costs([Size(), LARGE], quick=quick)
    count = len(parts(layout(LARGE)))
    label = f"{LARGE.bins} bins, {LARGE.belts} belts, {LARGE.carriers} AGVs, {count} parts"
    yield Figure(f"step, {label}", large, "us/step")
    yield Figure(f"{label} / the cell of 2017 with {len(parts(layout(Size())))} parts", large / small)


def _costs(sizes: list[Size], *, quick: bool) -> tuple[float, ...]:
    """Return the cost of a step of cells [us]."""
    warm_up, window, repeats = (50, 20, 1) if quick else (WARM_UP, WINDOW, REPEATS)
    cells = [cell_of(size, (warm_up + repeats * window) // 500 + 2) for size in sizes]
    for cell in cells:
        run(cell, warm_up)
    times = best_in_turn(repeats, *(partial(processor_time, partial(run, cell, window)) for cell in cells))
    return tuple(each / window * 1e6 for each in times)
