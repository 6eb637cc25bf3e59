"""Pictures that a run leaves behind: those asked for at given times, and the one at the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

from cellwright.cell import Cell
from cellwright.errors import UsageError
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import Progress, save_picture


class Pictures:
    """Takes pictures of one run, and knows which were taken.

    Args:
        camera: where they are taken from.
        wanted: simulation times [s] and files.
        say: takes a line about a picture that could not be written or was never taken.
    """

    def __init__(self, camera: Camera, wanted: Sequence[tuple[Fraction, Path]], say: Callable[[str], None]) -> None:
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
            save_picture(file, *cell.seen, self._camera, progress=progress)
        except UsageError as error:  # the disk is full, the folder is gone: the run is worth more than its picture
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
