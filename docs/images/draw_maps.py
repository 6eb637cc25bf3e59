"""Draws the maps of cells in docs/images, of 2017's cell and of a new one: python docs/images/draw_maps.py."""

import tempfile
from dataclasses import replace
from pathlib import Path

from cellwright import load_trial
from cellwright.cell.checks.clearance import place_reaches
from cellwright.cli.cell.new import start
from cellwright.viewer.cell_map import draw_map

HERE = Path(__file__).parent

draw_map(replace(load_trial("lesson"), name="2017", sensors=(), bin_parts=()), HERE / "cell-map.svg")
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "mine.yaml"
    file.write_bytes(start())
    trial = load_trial(file)
draw_map(trial, HERE / "own-cell.svg")
draw_map(trial, HERE / "own-cell-reach.svg", [*place_reaches(trial)])
