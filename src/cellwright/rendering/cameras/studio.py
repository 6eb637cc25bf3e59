"""Where the pictures of a cell's cameras are drawn: a process of its own, which all of them share.

A picture is asked for in one tick and fetched in a later one, and physics goes on meanwhile. What is drawn depends on
the frame of the tick in which it was asked for, and on nothing else.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Collection

import mujoco

from cellwright.engine.simulation import Simulation
from cellwright.rendering.painter import Drawn, Painter, View
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.scene.scene import Frame, Scene
from cellwright.util.errors import RenderingError
from cellwright.util.pose import Vector3


class Studio:
    """Takes frames of a simulation, and has a painter draw them.

    Args:
        simulation: whose model and state are seen.
        hire: makes the painter of a scene; called when the first picture is wanted.
        hidden: tells the engine's ids of bodies that are not there to be seen at the moment.
        report: takes a line when nothing more can be drawn.
    """

    def __init__(
        self,
        simulation: Simulation,
        hire: Callable[[Scene], Painter],
        *,
        hidden: Callable[[], Collection[int]] = tuple,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self._simulation = simulation
        self._hire = hire
        self._hidden = hidden
        self._report = report
        self._taker: SceneTaker | None = None
        self._painter: Painter | None = None
        self._frame: Frame | None = None
        self._tick = -1
        self._is_broken = False

    @property
    def model(self) -> mujoco.MjModel:
        """The engine's model."""
        return self._simulation.model

    def ask(self, view: View) -> int | None:
        """Ask for a picture of this tick; its number, or None when nothing can be drawn."""
        if self._is_broken:
            return None
        try:
            if self._taker is None:
                self._taker = SceneTaker(self.model, hidden=self._hidden)
            if self._painter is None:
                self._painter = painter = self._hire(self._taker.scene)
                self._end = weakref.finalize(
                    self, painter.close
                )  # also for those who forget a cell and do not close it
            return self._painter.submit(self._this_frame(self._taker), view)
        except RenderingError as error:
            self._give_up(error)
            return None

    @property
    def is_ready(self) -> bool:
        """Whether pictures are being drawn, and no longer prepared for."""
        return self._painter is not None and self._painter.is_ready

    def is_drawn(self, number: int) -> bool:
        """Whether a picture can be fetched without waiting."""
        return self._painter is None or self._painter.is_drawn(number)

    def fetch(self, number: int) -> Drawn | None:
        """A picture that was asked for; waits for it. None when it could not be drawn."""
        if self._painter is None:
            return None
        try:
            return self._painter.fetch(number)
        except RenderingError as error:
            self._give_up(error)
            return None

    def forget(self, number: int) -> None:
        """A picture is not wanted any more."""
        if self._painter is not None:
            self._painter.forget(number)

    def reopen(self) -> None:
        """Try again, with another painter, what has failed; called when a run begins."""
        self._is_broken = False
        self._tick = -1

    def close(self) -> None:
        """Let the painter go."""
        if self._painter is not None:
            self._end()
            self._painter = None

    def _this_frame(self, taker: SceneTaker) -> Frame:
        """The frame of this tick; cameras that look in one tick share it."""
        simulation = self._simulation
        simulation.refresh()
        if self._frame is None or self._tick != simulation.clock.tick:
            self._frame = taker.frame(simulation.data, simulation.now)
            self._tick = simulation.clock.tick
        return self._frame

    def _give_up(self, error: RenderingError) -> None:
        if not self._is_broken:
            self._is_broken = True
            self._report(f"cameras take no more pictures in this run: {error}")
            self.close()


def hire_painter(scene: Scene, *, about: Vector3 | None = None) -> Painter:
    """The painter of a cell or a robot: a process that draws.

    Args:
        scene: what there is to be seen.
        about: the point [m] that the lamp is placed by; None takes that of a cell's pictures.
    """
    from cellwright.rendering.camera import VIEWS
    from cellwright.rendering.worker.client import WorkerPainter

    return WorkerPainter(scene, about=VIEWS["overview"].target if about is None else about)
