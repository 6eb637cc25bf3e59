"""Fates of parts in a running cell: where each went, and its evidence in the score."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import KitSubmitted
from cellwright.cell.kitting.evidence import PartEvidence
from cellwright.cell.kitting.fates import Removal
from cellwright.config.trial.trial import KitObject, Part
from cellwright.engine.snapshot import read_checkpoint, restore_snapshot, take_snapshot, write_checkpoint
from cellwright.util.pose import Pose
from tests.cell.test_competition import effects_of, grip
from tests.support.cells import (
    ABOVE_THE_ROD,
    GEARS,
    ROD_IN_REACH,
    TRAY_1,
    WHOLE,
    order,
    publish,
    region,
    run,
    start,
    way,
)

ROD_ORDER = order(0, (KitObject("piston_rod_part", Pose()),))
RODS = replace(WHOLE, orders=(ROD_ORDER,), extra_parts=())


def carry(cell: Cell, seconds: float = 1.5) -> None:
    """Grip the rod below the cup, and lift it."""
    run(cell, 0.2)
    start(cell)
    grip(cell)
    publish(cell, "arm/command", way(ABOVE_THE_ROD))
    run(cell, seconds)


def release(cell: Cell) -> None:
    assert cell.gripper is not None
    cell.gripper.set_enabled(False)


def submitted_part(cell: Cell, number: int = 1) -> PartEvidence:
    """Submit the tray, and return the score's evidence for the only ordered part."""
    cell.agvs[number].send("order_0_kit_0")
    run(cell, 0.8)
    ((part,),) = [kit.parts for order in cell.competition.evidence().orders for kit in order.kits]
    return part


def test_fate_of_part_dropped_over_bin_is_dropped() -> None:
    cell = Cell(RODS)
    effects = effects_of(cell)
    carry(cell)
    release(cell)
    run(cell, 1.0)
    part = submitted_part(cell)
    assert part.fate is not None
    assert (part.fate.kind, part.fate.part) == ("dropped", ROD_IN_REACH.name)
    x, y, _ = part.fate.position or (0.0, 0.0, 0.0)
    held = part.fate.held / 1e9
    assert held == pytest.approx(1.5, abs=0.01)
    assert part.sentence() == (
        f"not on the tray at submission: {ROD_IN_REACH.name} was dropped at ({x:.2f}, {y:.2f}) m "
        f"after {held:.1f} s in the gripper"
    )
    (submitted,) = [effect for effect in effects if isinstance(effect, KitSubmitted)]
    assert submitted.fates == (part.fate,)
    assert cell.competition.score().total == 0.0


def test_fate_of_forced_drop_has_final_position() -> None:
    destination = Pose((-1.0, 0.23, 0.75))
    cell = Cell(replace(RODS, drop_regions=(region((-1.0, -1.0, 0.8), (1.0, 1.0, 2.0), destination),)))
    carry(cell)
    part = submitted_part(cell)
    assert part.fate is not None
    assert part.fate.kind == "forced drop"
    assert part.fate.position is not None
    assert 0.8 <= part.fate.position[2] < 1.0
    assert part.sentence().endswith("s in the gripper; it lay at (-1.00, 0.23) m")


def test_fate_of_part_on_other_tray_is_other_tray() -> None:
    cell = Cell(RODS)
    carry(cell)
    release(cell)
    rod = cell.parts.part(ROD_IN_REACH.name)
    cell.parts.place(rod, cell.trays[2].world_T_tray @ Pose((0.0, 0.0, 0.006)))
    run(cell, 1.2)
    assert submitted_part(cell).sentence().endswith(f"{ROD_IN_REACH.name} was on agv2's tray")


def test_fate_of_part_on_other_part_is_stacked() -> None:
    disk = Part("tray1|disk_part_1", "disk_part", Pose((0.0, 0.0, 0.006)), TRAY_1)
    cell = Cell(replace(RODS, extra_parts=(disk,)))
    carry(cell)
    release(cell)
    rod = cell.parts.part(ROD_IN_REACH.name)
    cell.parts.place(rod, cell.trays[1].world_T_tray @ Pose((0.0, -0.05, 0.03)))
    run(cell, 1.2)
    assert (
        submitted_part(cell).sentence().endswith("lay above agv1's tray without touching its plate, at (0.30, 3.20) m")
    )


def test_fate_of_ungripped_type_counts_parts_removed_by_wall() -> None:
    gears = replace(RODS, orders=(order(0, GEARS[:1]),))
    cell = Cell(gears)
    start(cell)
    for number, (name, _) in enumerate(cell.world.clones[:2]):
        cell.parts.appear(name, Pose((1.2, 4.0 - number, 1.0)))
        cell.parts.put_away(cell.parts.part(name), Removal.DELETION_WALL)
    assert submitted_part(cell).sentence() == (
        "not on the tray at submission: never gripped; the deletion wall of the belt removed 2 of its type"
    )


def test_fates_are_outside_state_and_restored_from_snapshots(tmp_path: Path) -> None:
    cell = Cell(RODS)
    carry(cell)
    before, state = take_snapshot(cell.simulation), cell.state_hash()
    record = cell.competition.get_record()
    assert record["parts"][ROD_IN_REACH.name]["taken"] is not None
    cell.competition.set_record({})
    assert cell.state_hash() == state
    restore_snapshot(cell.simulation, before)
    assert cell.competition.get_record() == record
    release(cell)
    run(cell, 1.0)
    first = submitted_part(cell)
    path = tmp_path / "judged.npz"
    write_checkpoint(cell.simulation, path)
    restore_snapshot(cell.simulation, before)
    release(cell)
    run(cell, 1.0)
    assert submitted_part(cell) == first
    other = Cell(RODS)
    read_checkpoint(other.simulation, path)
    ((part,),) = [kit.parts for order in other.competition.evidence().orders for kit in order.kits]
    assert part == first
    other.reset()
    assert other.competition.get_record() == {}
