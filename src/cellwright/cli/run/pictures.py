"""Pictures that a run leaves behind: those asked for at given times, and the one at the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from fractions import Fraction
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import Progress, render
from cellwright.rendering.png import save
from cellwright.rendering.scene.taking import SceneTaker
from cellwright.rendering.video_wish import HEIGHT, WIDTH
from cellwright.util.errors import RenderingError, UsageError


class Quality(StrEnum):
    """How pictures are drawn."""

    FINE = "fine"
    """By rays, with soft shadows from many lamps: some seconds each."""
    FAST = "fast"
    """As a video is, by OpenGL: a second each, most of it for its start."""


class Pictures:
    """Takes pictures of one run, and knows which were taken.

    Args:
        camera: where they are taken from.
        wanted: simulation times [s] and files.
        say: takes a line about a picture that could not be written or was never taken.
        quality: how they are drawn.
    """

    def __init__(
        self,
        camera: Camera,
        wanted: Sequence[tuple[Fraction, Path]],
        say: Callable[[str], None],
        quality: Quality = Quality.FINE,
    ) -> None:
        self._quality = quality
        self._camera = camera
        self._wanted = wanted
        self._say = say
        self.written: list[str] = []
        """The files that were written, in order."""
        self.missed: list[str] = []
        """The files that were asked for and not written."""

    def actions(self) -> list[tuple[Fraction, Callable[[Cell], None]]]:
        """What a run is to do at which time [s]."""
        return [(when, self._action(file)) for when, file in self._wanted]

    def finish(self, simulated: float) -> None:
        """Say which pictures were never taken, for the run ended before, at `simulated` [s]."""
        for when, file in self._wanted:
            if str(file) not in (*self.written, *self.missed):
                self._miss(file, f"{file} was not taken: the run ended at {simulated:g} s, before {float(when):g} s")

    def take(self, file: Path, cell: Cell, progress: Progress | None = None) -> None:
        """Take a picture now."""
        try:
            if self._quality is Quality.FAST:
                _save_fast(file, cell, self._camera)
            else:
                save(file, render(*cell.seen, self._camera, progress=progress))
        # the disk is full, the folder is gone: the run is worth more than its picture
        except (UsageError, RenderingError) as error:
            self._miss(file, str(error))
        else:
            self.written.append(str(file))

    def _action(self, file: Path) -> Callable[[Cell], None]:
        def take(cell: Cell) -> None:
            self.take(file, cell)

        return take

    def _miss(self, file: Path, reason: str) -> None:
        self.missed.append(str(file))
        self._say(reason)


def _save_fast(file: Path, cell: Cell, camera: Camera) -> None:
    from cellwright.rendering.worker import RenderWorker  # it takes a moment to load

    cell.simulation.refresh()
    taker = SceneTaker(cell.simulation.model, name=cell.name, hidden=cell.out_of_sight)
    frame = taker.frame(cell.simulation.data, cell.simulation.now)
    with RenderWorker(taker.scene) as worker:
        picture = worker.colour(frame, camera, WIDTH, HEIGHT, samples=4).result()
    save(file, picture)
