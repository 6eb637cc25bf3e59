"""Draws docs/images/cell.png: the lesson's cell, the arm lifting its second rod. To be run from the project's root."""

import math
from fractions import Fraction

from cellwright.agents.lesson import LessonAgent
from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import save_picture
from cellwright.run import RunOptions, run_cell

CAMERA = Camera(eye=(-1.75, -0.3, 1.55), target=(0.4, 0.95, 0.86), fov=math.radians(53))


def draw(cell: Cell) -> None:
    """Take the picture, with four rays along each side of a pixel where surfaces meet."""
    save_picture("docs/images/cell.png", *cell.seen, CAMERA, 1040, 585, samples=4)


cell = Cell(load_trial([find_trial("lesson")]).trial)
run_cell(cell, LessonAgent(), RunOptions(until=10.0, at=[(Fraction("9.85"), draw)]))
