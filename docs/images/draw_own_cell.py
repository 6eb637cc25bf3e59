"""Draws docs/images/own-cell.svg, the map of a new cell: python docs/images/draw_own_cell.py."""

import tempfile
from pathlib import Path

from cellwright import load_trial
from cellwright.cli.cell.new import start
from cellwright.viewer.cell_map import draw_map

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "mine.yaml"
    file.write_bytes(start())
    draw_map(load_trial(file), Path(__file__).parent / "own-cell.svg")
