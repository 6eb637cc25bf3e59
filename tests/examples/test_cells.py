"""Cells of the examples: short files that load without a warning."""

from pathlib import Path

import pytest

from cellwright.config.trial.gear2017 import load_trial

CELLS = sorted((Path(__file__).parents[2] / "examples" / "cells").glob("*.yaml"))


@pytest.mark.parametrize("path", CELLS, ids=lambda path: str(path.stem))
def test_cell_loads_and_its_kits_can_be_filled(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 40
    loaded = load_trial([path])
    trial = loaded.trial
    assert loaded.warnings == ()
    assert trial.has_arm
    there = {part.type for part in trial.bin_parts} | {part.type for part in trial.belt_parts}
    kits = [kit for order in trial.orders for kit in order.kits]
    assert {each.type for kit in kits for each in kit.objects} <= there
    assert {kit.tray for kit in kits} <= {each.name for each in trial.stations}
    # something looks at each place
    seen = {sensor.name.removeprefix("logical_camera_") for sensor in trial.sensors}
    places = {part.name.partition("|")[0] for part in trial.bin_parts} | {kit.tray for kit in kits}
    assert places <= seen


def test_cells_are_found() -> None:
    assert len(CELLS) >= 6
