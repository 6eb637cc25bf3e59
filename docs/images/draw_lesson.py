"""Draws the pictures of docs/lesson.md from its example's files. To be run from the project's root."""

import math
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.clients.agents.lesson import LessonAgent
from cellwright.config.trial.gear2017 import load_trial
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import CastRenderer, PictureRequest, save_png
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.views import gear2017_views
from cellwright.running.run import RunOptions, run_cell

CONFIG = Path("examples/lesson/industrial_control/config")
TRAY = Camera(eye=(-0.45, 2.5, 1.45), target=(0.3, 3.13, 0.74), fov=math.radians(40))


def draw(name: str, config: str, camera: Camera, agent: LessonAgent | None, until: float | None) -> None:
    """Run a configuration, and take a picture of how it ends.

    Args:
        name: of the picture.
        config: name of the configuration.
        camera: name of the view.
        agent: the agent, if any.
        until: end of the run [s]; None ends it with the agent.
    """
    cell = Cell(load_trial([CONFIG / f"{config}.yaml"]).trial)
    run_cell(cell, agent, RunOptions(until=until))
    cell.simulation.refresh()
    capture = SceneCapture.of(cell)
    frame = capture.frame(cell.simulation.data, cell.simulation.now)
    picture = CastRenderer(capture.scene).colour(frame, PictureRequest(camera, 800, 450, samples=4))
    save_png(f"docs/images/lesson-{name}.png", picture)


draw("first", "first_config", gear2017_views()["overview"], None, 2.0)
draw("bins", "my_config", gear2017_views()["bins"], None, 8.0)
draw("tray", "my_config", TRAY, LessonAgent(), None)
