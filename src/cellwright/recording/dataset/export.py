"""Export of recordings as a data set, which goes on where an earlier one was stopped."""

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from cellwright.clients.operators.bags import is_bag, opened_bag
from cellwright.recording.dataset.bagged import bag_episode
from cellwright.recording.dataset.episode import Episode
from cellwright.recording.dataset.kept import kept_episode
from cellwright.recording.dataset.lerobot import write_lerobot
from cellwright.recording.dataset.recorded import recorded_episode
from cellwright.recording.format.reader import RecordingFile
from cellwright.util.errors import ForeignRecordingError


def export_recordings(
    recordings: Sequence[str | Path],
    folder: str | Path,
    *,
    hz: int = 20,
    cameras: Sequence[str] = (),
    sentence: str = "",
    on_progress: Callable[[int, int], None] = lambda _episodes, _frames: None,
) -> None:
    """Write recordings as a LeRobotDataset v3.0, whole or not at all.

    Each becomes an episode of `recorded_episode`, or of `bag_episode` if another program has recorded it.

    Finished episodes are kept in a hidden folder, `.NAME.part`, until the set is whole. So an export that was killed,
    or met an error, goes on from them when it is called again. The set has the bytes of an undisturbed one.

    Args:
        recordings: complete recordings and bags of ROS, in the order of the episodes.
        folder: the new folder of the set.
        hz: frames in a second [Hz].
        cameras: names of the colour cameras whose pictures are drawn again, or of a bag's topics of pictures.
        sentence: the task in words; empty for that of the trial.
        on_progress: takes the number of episodes and of frames so far, after each episode.

    Raises:
        RecordingError: a recording is truncated or cannot be run again, or its run differs here.
        UsageError: the folder exists, or as of `write_lerobot`, `recorded_episode` and `bag_episode`.
        UnknownNameError: there is no such camera.
        OSError: the set cannot be written.

    Example:
        >>> import cellwright
        >>> options = cellwright.RunOptions(until=0.2)
        >>> result = cellwright.run_trial("pick_from_bin", None, record="export-me.mcap", options=options)
        >>> export_recordings(["export-me.mcap"], "exported")
        >>> Path("exported/meta/info.json").is_file(), Path(".exported.part").exists()
        (True, False)
    """
    folder, paths = Path(folder), [Path(each) for each in recordings]
    bags = {path for path in paths if _is_foreign(path)}  # a file that is none is refused before the first run
    unfinished = unfinished_folder(folder)
    settings = {"hz": hz, "cameras": [*cameras], "sentence": sentence}

    def episodes() -> Iterator[Episode]:
        for path in paths:
            maker = bag_episode if path in bags else recorded_episode
            make = partial(maker, path, hz, cameras, sentence=sentence)
            yield kept_episode(unfinished / "episodes", path, settings, make)

    try:
        write_lerobot(folder, episodes(), on_progress, beside=unfinished)
        shutil.rmtree(unfinished, ignore_errors=True)
    finally:
        with suppress(OSError):  # it stays if it has finished episodes
            unfinished.rmdir()


def unfinished_folder(folder: Path) -> Path:
    """Return the hidden folder of the finished episodes of a data set that is not yet whole.

    Example:
        >>> unfinished_folder(Path("sets/picks")).as_posix()
        'sets/.picks.part'
    """
    return folder.parent / f".{folder.name}.part"


def _is_foreign(path: Path) -> bool:
    """Return whether a file is a recording of another program; a RecordingError or a UsageError if it is neither."""
    if not is_bag(path) and path.suffix.lower() != ".db3":
        try:
            with RecordingFile(path):
                return False
        except ForeignRecordingError:
            pass
    with opened_bag(path):
        return True
