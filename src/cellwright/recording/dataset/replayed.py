"""Actions of a data set, replayed in environments: whether each episode succeeds again."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.config.trial.trial import Trial
from cellwright.envs.cell_env import CellEnv
from cellwright.recording.dataset.digest import sha256_of
from cellwright.recording.dataset.read import DataSet
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.util.errors import UsageError

_NEEDED = ("observation.state", "action", "next.success")


@dataclass(frozen=True, slots=True)
class ReplayedEpisode:
    """Outcome of an episode's actions in an environment.

    Attributes:
        number: of the episode in its set, from 0.
        source: name of its recording.
        was_success: True if the recorded run succeeded.
        is_success: True if the actions do.

    Example:
        >>> ReplayedEpisode(0, "run.mcap", True, False).was_success
        True
    """

    number: int
    source: str
    was_success: bool
    is_success: bool


def replay_actions(folder: str | Path, recordings: Sequence[str | Path]) -> Iterator[ReplayedEpisode]:
    """Replay the actions of each episode of a data set in a `CellEnv`, at the rate of the set; yield how each ends.

    An environment gets nothing of a recording but its trial and its seed, as a policy's does. A policy that
    learned these actions perfectly would succeed as often. Needs `cellwright[gym,parquet,video]`.

    Args:
        folder: of the data set.
        recordings: the recording of each of its episodes, of cells with a task; in any order, under any name.

    Raises:
        UsageError: the set has a fault, a recording is of no episode or has no task, or that of an episode is missing.
        RecordingError: a recording cannot be run again.

    Example:
        >>> list(replay_actions("no-such-set", []))
        Traceback (most recent call last):
        cellwright.util.errors.UsageError: no-such-set/meta/info.json: cannot be read: No such file or directory; ...
    """
    data = DataSet(folder)
    for number, path in enumerate(_in_order(data, [Path(each) for each in recordings])):
        columns = data.columns(number)
        if missing := [name for name in _NEEDED if name not in columns]:
            raise UsageError(f"{folder}: {missing[0]}: column is missing; replay sets of cells alone")
        trial, seed = _start_of(path)
        with closing(CellEnv(trial, rate=data.rate, privileged=False)) as env:
            observation, _ = env.reset(seed=seed, options={"variation": False})
            if observation["agent_pos"].tolist() != columns["observation.state"][0].tolist():
                text = f"its run begins otherwise here than in episode {number} of {folder}"
                raise UsageError(f"{path}: {text}; replay with the versions that exported it")
            was_success = bool(columns["next.success"][-1])
            yield ReplayedEpisode(number, path.name, was_success, _succeeds(env, columns["action"]))


def _in_order(data: DataSet, recordings: Sequence[Path]) -> list[Path]:
    """Return the recording of each episode."""
    wanted = [data.recording(number) for number in range(len(data))]
    given = {_digest(path): path for path in recordings}
    for digest, path in given.items():
        if digest not in (each for _, each in wanted):
            text = f"is the recording of no episode of {data.folder} (got SHA-256 {digest:.12}…)"
            raise UsageError(f"{path}: {text}; leave it out, or export it too")
    for number, (name, digest) in enumerate(wanted):
        if digest not in given:
            text = f"the recording of episode {number} is missing (it is {name}, SHA-256 {digest:.12}…)"
            raise UsageError(f"{data.folder}: {text}; give that of each episode")
    return [given[digest] for _, digest in wanted]


def _digest(path: Path) -> str:
    with RecordingFile(path):  # another file is refused as what it is
        return sha256_of(path)


def _start_of(path: Path) -> tuple[Trial, int]:
    """Return the trial and the seed of a recorded run."""
    with RecordingFile(path) as recording:
        if recording.start is not None:
            raise UsageError(f"{path}: begins from a checkpoint, as no environment does; leave its episode out")
        with rebuild(recording) as rebuilt:
            if not isinstance(rebuilt.served, Cell):
                raise UsageError(f"{path}: is of a robot's node; replay sets of cells alone")
            return rebuilt.served.trial, int(recording.header.facts["seed"])


def _succeeds(env: CellEnv, actions: NDArray[Any]) -> bool:
    for action in actions:
        _, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    return bool(info["is_success"])
