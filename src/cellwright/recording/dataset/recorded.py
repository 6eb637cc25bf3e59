"""Recordings as episodes of a data set: what was seen and executed in each frame of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.engine.clock import seconds
from cellwright.recording.dataset.digest import sha256_of
from cellwright.recording.dataset.episode import Column, Episode
from cellwright.recording.dataset.frames import frame_instants
from cellwright.recording.dataset.layout import picture_key
from cellwright.recording.dataset.outcomes import FrameOutcome, Outcomes, outcome_columns
from cellwright.recording.dataset.readings import cameras_of, readings_of
from cellwright.recording.format.reader import RecordingFile
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera, ask_pictures
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.util.errors import RecordingError, UsageError
from cellwright.util.plugins import is_installed

Pictures: TypeAlias = dict[str, NDArray[np.uint8]]
"""Pictures of a frame, (height, width, 3) sRGB, by the names of the cameras."""


def recorded_episode(path: str | Path, hz: int = 20, cameras: Sequence[str] = (), *, sentence: str = "") -> Episode:
    """Return a recorded run as an episode of a data set, with the pictures of its cameras as films.

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
    path = Path(path)
    with RecordingFile(path) as recording, _repeated(recording, hz, cameras) as run:
        words = sentence or run.sentence
        if not words:
            raise UsageError(f"sentence: {run.served.name} has no task that says one; give the task in words")
        if not cameras:
            return replace(run.episode(), sentence=words)
        if not is_installed("av"):
            raise UsageError("cameras: videos need the package av; pip install 'cellwright[video]'")
        from cellwright.recording.dataset.films import Films

        films = Films(path.name, cameras, int(hz))
        return replace(run.episode(films.add), sentence=words, films=films.finish())


def recorded_arrays(recording: RecordingFile, hz: int, cameras: Sequence[str]) -> Episode:
    """Return a recorded run as an episode whose pictures are columns; see `Recording.dataset`."""
    pictures: dict[str, list[NDArray[np.uint8]]] = {name: [] for name in cameras}

    def keep(seen: Pictures) -> None:
        for name, picture in seen.items():
            pictures[name].append(picture)

    with _repeated(recording, hz, cameras) as run:
        episode = run.episode(keep)
    columns = (Column(picture_key(name), np.stack(taken), ()) for name, taken in pictures.items())
    return replace(episode, columns=(*episode.columns, *columns))


@contextmanager
def _repeated(recording: RecordingFile, hz: int, cameras: Sequence[str]) -> Iterator[_Repetition]:
    """Begin to repeat a run; an unknown camera is refused before it goes on."""
    with closing(frame_instants(recording, hz)) as instants:
        served = next(instants, None)
        if served is None:
            raise _no_frame(recording.path)
        drawn = dict(zip(cameras, cameras_of(served, cameras), strict=True))
        yield _Repetition(recording.path, served, instants, int(hz), drawn)


@dataclass(frozen=True)
class _Repetition:
    """A run that stands at the begin of its first frame."""

    path: Path
    served: DrawnNode
    instants: Iterator[DrawnNode]
    hz: int
    cameras: Mapping[str, PictureCamera]

    @property
    def sentence(self) -> str:
        """Task of the trial in words; empty if there is none."""
        task = self.served.trial.task if isinstance(self.served, Cell) else None
        return "" if task is None else task.sentence

    def episode(self, on_pictures: Callable[[Pictures], None] = lambda _pictures: None) -> Episode:
        """Repeat the rest, and return the episode of the run, without films.

        Pictures are asked for at the begin of a frame, drawn while time goes on, and taken at its end. So a frame that
        does not come about, after the last one, has no picture.
        """
        begin = seconds(self.served.simulation.now)
        readings = readings_of(self.served, self.hz)
        judge = Outcomes(self.served) if isinstance(self.served, Cell) else None
        states, actions, outcomes = [readings.measured()], list[list[float]](), list[FrameOutcome]()
        asked = ask_pictures(self.cameras.values())
        for _ in self.instants:
            actions.append(readings.executed())
            on_pictures({name: _colour(each) for name, each in zip(self.cameras, asked(), strict=True)})
            if judge is not None:
                outcomes.append(judge.read())
                if outcomes[-1].is_over:
                    break
            states.append(readings.measured())
            asked = ask_pictures(self.cameras.values())
        if not actions:
            raise _no_frame(self.path)
        columns = (
            Column("observation.state", np.array(states[: len(actions)], np.float32), readings.names, readings.units),
            Column("action", np.array(actions, np.float32), readings.names, readings.units),
            *outcome_columns(len(actions), outcomes),
        )
        return Episode(
            source=self.path.name,
            robot=readings.robot,
            sentence=self.sentence,
            rate=self.hz,
            columns=columns,
            films=(),
            is_success=bool(outcomes) and outcomes[-1].is_success,
            begin=begin,
            sha256=sha256_of(self.path),
        )


def _colour(picture: Picture) -> NDArray[np.uint8]:
    assert picture.colour is not None  # the camera takes colours
    return picture.colour


def _no_frame(path: Path) -> RecordingError:
    return RecordingError(f"{path}: the run is shorter than a tick; record a longer one")
