"""Recordings as episodes of a data set: what was seen and executed in each frame of the run."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.recording.dataset.episode import Column, Episode
from cellwright.recording.dataset.frames import frame_instants
from cellwright.recording.dataset.outcomes import FrameOutcome, Outcomes
from cellwright.recording.dataset.readings import cameras_of, readings_of
from cellwright.recording.format.reader import RecordingFile
from cellwright.rendering.cameras.picture_camera import read_pictures
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.util.errors import RecordingError, UsageError


def recorded_episode(path: str | Path, hz: int = 20, cameras: Sequence[str] = (), *, sentence: str = "") -> Episode:
    """Return a recorded run as an episode of a data set.

    The run is repeated from its commands, so any recording that `replay --verify` can verify is suitable: of an agent,
    a policy, a person or a program over ROS. Values are those of the simulation, not of messages.

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
        `next.reward` and `next.success`. Its pictures are drawn when they are asked for.

    Raises:
        RecordingError: the recording is truncated or cannot be run again, or its run differs here.
        UsageError: a frame would be no whole number of ticks, or there is no sentence.
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
        cameras_of(served, names)  # an unknown one is refused before the run
        readings = readings_of(served, hz)
        judge = Outcomes(served) if isinstance(served, Cell) else None
        states.append(readings.measured())
        for _ in instants:
            actions.append(readings.executed())
            if judge is not None:
                outcomes.append(judge.read())
                if outcomes[-1].is_over:
                    break
            states.append(readings.measured())
    if not actions:
        raise _no_frame(path)
    count = len(actions)
    columns = (
        Column("observation.state", np.array(states[:count], np.float32), readings.names),
        Column("action", np.array(actions, np.float32), readings.names),
        *_outcome_columns(count, outcomes),
    )
    pictures = partial(_pictures, path, hz, names, count)
    is_success = bool(outcomes) and outcomes[-1].is_success
    return Episode(path.name, readings.robot, words, int(hz), columns, names, pictures, is_success)


def _outcome_columns(count: int, outcomes: Sequence[FrameOutcome]) -> Iterator[Column]:
    """Yield what the frames come to; nothing judges those of a robot's node."""
    if outcomes:
        yield Column("next.reward", np.array([each.reward for each in outcomes], np.float32), ())
        yield Column("next.success", np.array([each.is_success for each in outcomes], np.bool_), ())
    done = np.arange(count) == count - 1
    yield Column("next.done", done, ())
    is_terminated = bool(outcomes) and outcomes[-1].is_terminated
    yield Column("next.truncated", done & (not is_terminated), ())


def _pictures(path: Path, hz: int, cameras: tuple[str, ...], count: int) -> Iterator[dict[str, NDArray[np.uint8]]]:
    """Yield the pictures of each frame, from the run repeated once more."""
    with RecordingFile(path) as recording, closing(frame_instants(recording, hz)) as instants:
        for _, served in zip(range(count), instants, strict=False):
            found = {}
            for name, picture in zip(cameras, read_pictures(cameras_of(served, cameras)), strict=True):
                assert picture.colour is not None  # the camera takes colours
                found[name] = picture.colour
            yield found


def _sentence_of(served: DrawnNode) -> str:
    task = served.trial.task if isinstance(served, Cell) else None
    if task is None:
        raise UsageError(f"sentence: {served.name} has no task that says one; give the task in words")
    return task.sentence


def _no_frame(path: Path) -> RecordingError:
    return RecordingError(f"{path}: the run is shorter than a tick; record a longer one")
