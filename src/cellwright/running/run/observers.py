"""Observers of a run: each is called with the session, and returns a context manager that is left when the run is over.

They load their modules when they are called, so that a plain run loads none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import PictureRequest, Progress, render, save_png
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import EngineScene, SceneCapture
from cellwright.rendering.video_options import HEIGHT, WIDTH
from cellwright.rendering.views import Viewpoint, camera_of
from cellwright.running.run.cells import at
from cellwright.running.run.options import reachable_address
from cellwright.util.errors import RenderingError, UsageError

if TYPE_CHECKING:
    from cellwright.robot.node import RobotNode
    from cellwright.running.run.session import Session

_SCENE = 1  # number of the scene in a render process


class Quality(StrEnum):
    """Quality of pictures."""

    FAST = "fast"
    """By OpenGL, as videos are: a second each, most of it for its start; by rays where there is no OpenGL."""
    FINE = "fine"
    """By rays, with soft shadows from many lamps: half a minute of a processor each."""


class Pictures:
    """Pictures of a cell: an observer that takes them at their times, and lists those it has taken.

    Args:
        camera: the camera, or the name of a view of the cell.
        requests: simulation times [s] and files.
        on_miss: receives a line about each picture that could not be written or was never taken.
    """

    def __init__(
        self,
        camera: Viewpoint,
        requests: Sequence[tuple[Fraction, Path]],
        on_miss: Callable[[str], None],
        quality: Quality = Quality.FAST,
    ) -> None:
        self._quality = quality
        self.camera = camera
        self._requests = requests
        self._on_miss = on_miss
        self.written: list[str] = []
        """Files written, in order."""
        self.missed: list[str] = []
        """Files requested but not written."""

    @contextmanager
    def __call__(self, session: Session) -> Iterator[None]:
        """Take the pictures of one run."""
        cell = session.node
        self.written, self.missed = [], []
        with ExitStack() as run:
            for when, file in self._requests:
                at(cell, when, partial(self.take, file), run)
            yield
        if session.restart_requested:
            return
        ended = f"the run ended at {cell.simulation.time:g} s"
        for when, file in self._requests:
            if str(file) not in (*self.written, *self.missed):
                self._miss(file, f"{file}: picture not taken; {ended}, before {float(when):g} s")

    def take(self, file: Path, cell: Cell, progress: Progress | None = None) -> None:
        """Take a picture now."""
        capture = SceneCapture.of(cell)
        cell.simulation.refresh()
        frame = capture.frame(cell.simulation.data, cell.simulation.now)
        try:
            save_png(file, self._draw(capture.scene, frame, camera_of(self.camera, cell.views), progress))
        # the disk is full or the folder is gone: the run is worth more than its picture
        except (UsageError, RenderingError) as error:
            self._miss(file, str(error))
        else:
            self.written.append(str(file))

    def _draw(self, scene: Scene, frame: SceneFrame, camera: Camera, progress: Progress | None) -> NDArray[np.uint8]:
        if self._quality is Quality.FAST:
            from cellwright.rendering.worker import RenderWorker  # slow to load

            with RenderWorker() as worker:
                if worker.ask("scene", _SCENE, scene).result() != RAYS:
                    request = PictureRequest(camera, WIDTH, HEIGHT, samples=4)
                    return worker.colour(frame, request, _SCENE).result()
        return self._draw_by_rays(scene, frame, camera, progress)

    def _draw_by_rays(
        self, scene: Scene, frame: SceneFrame, camera: Camera, progress: Progress | None
    ) -> NDArray[np.uint8]:
        shown = EngineScene(scene)
        shown.show(frame)
        return render(shown.model, shown.data, camera, progress=progress)

    def _miss(self, file: Path, reason: str) -> None:
        self.missed.append(str(file))
        self._on_miss(reason)


@dataclass(frozen=True)
class RobotWindow:
    """Observer that shows a robot in MuJoCo's window while a session runs.

    Attributes:
        sliders: show a slider for each joint.
        snapshot: file for a picture of the robot at the end.
    """

    is_shown: bool = True
    sliders: bool = False
    snapshot: Path | None = None

    @contextmanager
    def __call__(self, session: Session) -> Iterator[None]:
        """Keep the window open.

        Raises:
            WindowError: no window can be opened.
        """
        node, server = session.node, session.server
        if not self.is_shown or server is None:
            yield
            return
        from cellwright.robot.services import RobotServices
        from cellwright.viewer.window import Window

        RobotServices(node).offer_state(server)
        window = Window(node.world.model, reachable_address(server.address), sliders=self.sliders)
        try:
            yield
        finally:
            window.close()

    def save(self, node: RobotNode, progress: Progress | None = None) -> None:
        """Write the picture, if one is requested; it takes some seconds.

        Raises:
            UsageError: the file cannot be written.
        """
        if self.snapshot is not None:
            from cellwright.robot.pictures import save_robot_picture

            save_robot_picture(self.snapshot, node.world, node.simulation.data, progress=progress)
