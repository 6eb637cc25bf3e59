"""Four seconds with every event of a cell, played in this process or in one of its own.

`python -m tests.support.scenario [--listen] [--continue FILE] [--seed N]` prints the state hash at the end.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.engine.clock import nanoseconds
from cellwright.engine.snapshot import read_checkpoint
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, VacuumGripperControlRequest
from tests.cell.interface.goals import send
from tests.support.cells import ABOVE_THE_ROD, INITIAL, WHOLE, call, order, publish, way, with_seed

END = 4.0
MIDDLE = 2.2
"""AGV 1 is under way with two locked gears, the cup holds a rod, a goal is followed, an order is interrupted."""

TRIAL = replace(WHOLE, orders=(order(), order(1, start_time=0.5), order(2, start_time=3.0)))

SCRIPT: tuple[tuple[float, Callable[[Cell], object]], ...] = (
    (0.0, lambda cell: call(cell, "start_competition")),
    (0.1, lambda cell: call(cell, "gripper/control", VacuumGripperControlRequest(True))),
    (0.6, lambda cell: publish(cell, "arm/command", way(ABOVE_THE_ROD))),
    (1.1, lambda cell: call(cell, "agv1", AGVControlRequest("order_1_kit_0"))),
    (2.0, lambda cell: send(cell, way(tuple(value + 0.1 for value in ABOVE_THE_ROD)), "")),
    (2.6, lambda cell: publish(cell, "arm/command", way(INITIAL, each=2.0))),
    (3.0, lambda cell: call(cell, "gripper/control", VacuumGripperControlRequest(False))),
)


def play(cell: Cell, until: float = END) -> Cell:
    """Continue the scenario from the cell's present time up to a time [s]."""
    begin, end = cell.simulation.now, nanoseconds(until)
    for time, act in SCRIPT:
        if begin <= nanoseconds(time) < end:
            cell.simulation.step_until(nanoseconds(time))
            act(cell)
    cell.simulation.step_until(end)
    return cell


def listen_to_all(cell: Cell) -> list[object]:
    """Subscribe to every topic; return the list of messages."""
    heard: list[object] = []
    for topic in cell.bus.topics():
        cell.bus.subscribe(topic.name, heard.append, node="/listener")
    return heard


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--listen", action="store_true")
    parser.add_argument("--continue", dest="file", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    cell = Cell(with_seed(TRIAL, arguments.seed))
    if arguments.listen:
        listen_to_all(cell)
    if arguments.file is not None:
        read_checkpoint(cell.simulation, arguments.file)
    print(play(cell).state_hash())


if __name__ == "__main__":
    main()
