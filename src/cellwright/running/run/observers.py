"""Observers of a run: each is called with the session, and returns a context manager that is left when the run is over.

They load their modules when they are called, so that a plain run loads none.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from enum import StrEnum
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import PictureRequest, Progress, render, save_png
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import EngineScene, SceneCapture
from cellwright.rendering.video_options import HEIGHT, WIDTH, VideoOptions
from cellwright.running.run.options import RecordOptions
from cellwright.running.run.targets import CellTarget, SessionState, at, cell_result, outcome_word
from cellwright.util.errors import RenderingError, UsageError

_SCENE = 1  # number of the scene in a render process


@contextmanager
def keep_log(session: SessionState) -> Iterator[None]:
    """Write the events of a run of a cell to the session's log as they happen."""
    from cellwright.recording.format.run_log import RunLog

    target, log = session.target, session.options.log
    if not isinstance(target, CellTarget):
        raise UsageError("log: only a cell has a log of events; leave it out for a robot or a recording")
    cell = target.node
    if log is None:
        assert session.log is not None
        log = RunLog(session.numbered_file(session.log), about=session.about, report=session.report)
    session.on_reset.append(log.reset)
    try:
        with target.events(log, {"time": cell.simulation.time}):
            yield
            result = cell_result(session.result)
            names = ("competition_state", "state_hash", "error", "simulated", "wall", "steps")
            facts = {name: getattr(result, name) for name in names}
            log.end(outcome_word(result), result.evidence, cell.simulation.now, facts)
            log.lines.close()
            result.is_complete = result.is_complete and log.lines.is_whole
    finally:
        session.on_reset.remove(log.reset)


@contextmanager
def record_run(session: SessionState, record: RecordOptions) -> Iterator[None]:
    """Record a run until it is over or broken off.

    Raises:
        UsageError: a file cannot be opened.
    """
    from cellwright.recording.format.files import RecordingFiles
    from cellwright.recording.format.format import SOURCES, START
    from cellwright.recording.format.recorder import Recorder

    target = session.target
    files = RecordingFiles([session.numbered_file(path) for path in record.paths], report=record.report)
    sources = {} if record.sources is None else record.sources.files()
    attachments = {f"{SOURCES}{name}": content for name, content in sources.items()}
    if session.options.start is not None:
        attachments[START] = session.options.start.read_bytes()
    recorder = Recorder(
        session.node,
        files.path,
        target.header(session, record),
        attachments=attachments,
        panel=lambda: target.recorded_panel(record),
        stamp=target.stamp,
        report=record.report,
    )
    recorder.renew_header = partial(target.header, session, record)
    end = {"outcome": "broken off"}
    try:
        with target.recorded_events(session, recorder, record):
            yield
        assert session.result is not None
        end = target.recorded_end(session.result)
    finally:
        recorder.end(end)
        files.finish(recorder.paths)
    result = session.result
    result.recordings, result.is_recorded = files.written, recorder.is_whole and files.is_whole
    result.is_complete = result.is_complete and result.is_recorded


@contextmanager
def take_video(session: SessionState, options: VideoOptions) -> Iterator[None]:
    """Take a video of a run; simulation time waits for it, unless it follows the wall clock.

    Raises:
        RenderingError: the file cannot be written.
    """
    numbered = replace(options, file=session.numbered_file(options.file))
    waits = session.lockstep or session.rate.speed is None
    film = session.target.film(numbered, waits=waits, report=session.report)
    film.expect(_latest_end(session), session.notice)
    film.start()
    try:
        yield
    finally:
        made = film.finish()
    assert session.result is not None
    session.result.videos.append(made)
    session.result.is_complete = session.result.is_complete and film.is_whole


def _latest_end(session: SessionState) -> int | None:
    """Return the simulation time [ns] at which the run ends at the latest; None if it has no end."""
    ends = [session.stop.deadline]
    if isinstance(session.target, CellTarget) and (limit := session.target.node.trial.time_limit) is not None:
        ends.append(nanoseconds(limit))
    return None if (end := min(ends)) == NEVER else end


class Quality(StrEnum):
    """Quality of pictures."""

    FAST = "fast"
    """By OpenGL, as videos are: a second each, most of it for its start; by rays where there is no OpenGL."""
    FINE = "fine"
    """By rays, with soft shadows from many lamps: half a minute of a processor each."""


class Pictures:
    """Pictures of a cell: an observer that takes them at their times, and lists those it has taken.

    Args:
        requests: simulation times [s] and files.
        on_miss: receives a line about each picture that could not be written or was never taken.
    """

    def __init__(
        self,
        camera: Camera,
        requests: Sequence[tuple[Fraction, Path]],
        on_miss: Callable[[str], None],
        quality: Quality = Quality.FAST,
    ) -> None:
        self._quality = quality
        self._camera = camera
        self._requests = requests
        self._on_miss = on_miss
        self.written: list[str] = []
        """Files written, in order."""
        self.missed: list[str] = []
        """Files requested but not written."""

    @contextmanager
    def __call__(self, session: SessionState) -> Iterator[None]:
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
            save_png(file, self._draw(capture.scene, frame, progress))
        # the disk is full or the folder is gone: the run is worth more than its picture
        except (UsageError, RenderingError) as error:
            self._miss(file, str(error))
        else:
            self.written.append(str(file))

    def _draw(self, scene: Scene, frame: SceneFrame, progress: Progress | None) -> NDArray[np.uint8]:
        if self._quality is Quality.FAST:
            from cellwright.rendering.worker import RenderWorker  # slow to load

            with RenderWorker() as worker:
                if worker.ask("scene", _SCENE, scene).result() != RAYS:
                    request = PictureRequest(self._camera, WIDTH, HEIGHT, samples=4)
                    return worker.colour(frame, request, _SCENE).result()
        return self._draw_by_rays(scene, frame, progress)

    def _draw_by_rays(self, scene: Scene, frame: SceneFrame, progress: Progress | None) -> NDArray[np.uint8]:
        shown = EngineScene(scene)
        shown.show(frame)
        return render(shown.model, shown.data, self._camera, progress=progress)

    def _miss(self, file: Path, reason: str) -> None:
        self.missed.append(str(file))
        self._on_miss(reason)


def has_desktop() -> bool:
    """Return whether this machine has a desktop on which a browser can be opened."""
    return (
        os.name == "nt"
        or os.uname().sysname == "Darwin"
        or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    )
