"""Small cells with tasks, for tests."""

from cellwright import Cell
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial

BASE = """
cell:
  bins: {bin1: {at: [-0.35, 0.0], size: [0.6, 0.5], surface: 0.72}}
  belts: {belt: {from: [1.1, 2.0], to: [1.1, -2.0], width: 0.5, surface: 0.9, speed: 0.2}}
  trays:
    tray1: {at: [-0.35, 0.8], surface: 0.755}
    tray2: {at: [-0.35, -0.8], surface: 0.755}
  arms: {arm: {mount: {kind: rail, at: [0.3, 0, 0.9]}}}
parts:
  - {type: gear_part, in: bin1, grid: [2, 1], from: [0.15, 0.38], step: [0.3, 0.1], turn: 0.5}
  - {type: pulley_part, in: bin1, from: [0.3, 0.13]}
  - {type: disk_part, on: belt, every: 10, after: 1, count: 3}
faulty_parts: [gear_part_1]
orders: {order_0: {tray: tray1, parts: [{type: gear_part, xy: [0.1, 0.1]}]}}
time_limit: 30
"""
"""A cell with an arm, a bin, a belt and two trays."""


def trial(success: str, more: str = "") -> Trial:
    """Return the trial of a task with these conditions, and further entries of the section `task`."""
    return load_trial(text=f"{BASE}task:\n  sentence: Do it.\n  success: {success}\n{more}").trial


def task_cell(success: str, more: str = "", seed: int = 0) -> Cell:
    """Return the cell of such a trial."""
    return Cell(trial(success, more), seed=seed)


def go(cell: Cell, seconds: float) -> None:
    """Let time pass."""
    cell.simulation.step_until(cell.simulation.now + round(seconds * 1e9))
