"""Recordings as episodes of a data set: what was seen and executed in each frame of the run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.recording.dataset.episode import Column, Episode, Film
from cellwright.recording.dataset.frames import frame_instants
from cellwright.recording.dataset.outcomes import FrameOutcome, Outcomes, outcome_columns
from cellwright.recording.dataset.readings import cameras_of, readings_of
from cellwright.recording.format.reader import RecordingFile
from cellwright.rendering.cameras.picture_camera import Picture, ask_pictures
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.util.errors import RecordingError, UsageError
from cellwright.util.plugins import is_installed

if TYPE_CHECKING:
    from cellwright.recording.dataset.films import Films

Pictures: TypeAlias = dict[str, NDArray[np.uint8]]
"""Pictures of a frame, (height, width, 3) sRGB, by the names of the cameras."""


def recorded_episode(
    path: str | Path,
    hz: int = 20,
    cameras: Sequence[str] = (),
    *,
    sentence: str = "",
    on_pictures: Callable[[Pictures], None] = lambda _pictures: None,
) -> Episode:
    """Return a recorded run as an episode of a data set.

    The run is repeated once from its commands, so any recording that `replay --verify` can verify is suitable: of an
    agent, a policy, a person or a program over ROS. Values are those of the simulation, not of messages.

    Frame k begins at k / hz [s]. Its `observation.state` is what is measured then, as `agent_pos` of an environment.
    Its `action` is what was executed until the frame ends: the targets of the joints at its end, after all limits, and
    the state of the grippers. With the same actions a `CellEnv` repeats the run: bit for bit if they were
    commanded in such periods, else nearly.

    Args:
        path: a complete recording of a cell or of a robot's node.
        hz: frames in a second [Hz]; a frame must be whole ticks.
        cameras: names of the colour cameras whose pictures are drawn again.
        sentence: the task in words; empty for that of the trial.
        on_pictures: takes the pictures of each frame, in order, before the losses of the video.

    Returns:
        The episode, with the columns `observation.state`, `action`, `next.done` and `next.truncated`; a cell's has also
        `next.reward` and `next.success`.

    Raises:
        RecordingError: the recording is truncated or cannot be run again, or its run differs here.
        UsageError: a frame would be no whole number of ticks, there is no sentence, a picture has an odd width or
            height, or the package av is missing for cameras.
        UnknownNameError: there is no such camera.

    Example:
        >>> import cellwright
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     path, options = f"{folder}/run.mcap", cellwright.RunOptions(until=0.2)
        ...     result = cellwright.run_trial("pick_from_bin", None, record=path, options=options)
        ...     episode = cellwright.recorded_episode(path, hz=20)
        >>> episode.robot, episode.sentence, episode.columns[0].values.shape
        ('cellwright_ur10', 'Pick up a gear from the bin.', (4, 8))
    """
    path, names = Path(path), tuple(cameras)
    states: list[list[float]] = []
    actions: list[list[float]] = []
    outcomes: list[FrameOutcome] = []
    with RecordingFile(path) as recording, closing(frame_instants(recording, hz)) as instants:
        served = next(instants, None)
        if served is None:
            raise _no_frame(path)
        words = sentence or _sentence_of(served)
        drawn = _Drawn(path.name, served, names, hz, on_pictures)  # an unknown camera is refused before the run
        readings = readings_of(served, hz)
        judge = Outcomes(served) if isinstance(served, Cell) else None
        states.append(readings.measured())
        drawn.ask()
        for _ in instants:
            actions.append(readings.executed())
            drawn.take()
            if judge is not None:
                outcomes.append(judge.read())
                if outcomes[-1].is_over:
                    break
            states.append(readings.measured())
            drawn.ask()
        if not actions:
            raise _no_frame(path)
        films = drawn.finish()
    columns = (
        Column("observation.state", np.array(states[: len(actions)], np.float32), readings.names),
        Column("action", np.array(actions, np.float32), readings.names),
        *outcome_columns(len(actions), outcomes),
    )
    is_success = bool(outcomes) and outcomes[-1].is_success
    return Episode(path.name, readings.robot, words, int(hz), columns, films, is_success)


class _Drawn:
    """Pictures of the cameras at the begin of each frame: asked for then, drawn while time goes on, taken at its end.

    So a frame that does not come about, after the last one, has no picture.
    """

    def __init__(
        self, source: str, served: DrawnNode, names: tuple[str, ...], hz: int, on_pictures: Callable[[Pictures], None]
    ) -> None:
        self._cameras, self._names = cameras_of(served, names), names
        self._on_pictures = on_pictures
        self._asked: Callable[[], list[Picture]] = list
        self._films: Films | None = None
        if names:
            if not is_installed("av"):
                raise UsageError("cameras: videos need the package av; pip install 'cellwright[video]'")
            from cellwright.recording.dataset.films import Films

            self._films = Films(source, names, int(hz))

    def ask(self) -> None:
        """Ask for the pictures of now."""
        if self._films is not None:
            self._asked = ask_pictures(self._cameras)

    def take(self) -> None:
        """Wait for the pictures, and add them to the films."""
        if self._films is None:
            return
        pictures: Pictures = {}
        for name, picture in zip(self._names, self._asked(), strict=True):
            assert picture.colour is not None  # the camera takes colours
            pictures[name] = picture.colour
        self._on_pictures(pictures)
        self._films.add(pictures)

    def finish(self) -> tuple[Film, ...]:
        """Return the films."""
        return () if self._films is None else self._films.finish()


def _films_of(source: str, names: tuple[str, ...], rate: int) -> Films:
    if not is_installed("av"):
        raise UsageError("cameras: videos need the package av; pip install 'cellwright[video]'")
    from cellwright.recording.dataset.films import Films

    return Films(source, names, rate)


def _sentence_of(served: DrawnNode) -> str:
    task = served.trial.task if isinstance(served, Cell) else None
    if task is None:
        raise UsageError(f"sentence: {served.name} has no task that says one; give the task in words")
    return task.sentence


def _no_frame(path: Path) -> RecordingError:
    return RecordingError(f"{path}: the run is shorter than a tick; record a longer one")
