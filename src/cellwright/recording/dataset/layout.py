"""Layout of LeRobotDataset v3.0: places of its files, columns that every set has, and names of its statistics.

Source: sets that LeRobot 0.6.1 has written, and its readers.
"""

VERSION = "v3.0"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
FILES_IN_CHUNK = 1000
MAX_DATA_MB, MAX_VIDEO_MB = 100, 200

FRAME_COLUMNS = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""Columns of every set with their types: time in the episode [s], frame of the episode, episode, row, sentence."""

VIDEO_COLUMNS = ("chunk_index", "file_index", "from_timestamp", "to_timestamp")
"""Columns of the table of episodes for each feature with videos, behind `videos/` and its name."""

RECORDING_COLUMNS = ("recording/name", "recording/sha256")
"""Columns of the table of episodes that say of which recording each is; readers of others take no notice of them."""

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
STATISTICS = ("min", "max", "mean", "std", "count", *QUANTILES)


def place(number: int) -> dict[str, int]:
    """Return chunk and place in it of the file with this number, from 0, as the paths above take them."""
    chunk, file = divmod(number, FILES_IN_CHUNK)
    return {"chunk_index": chunk, "file_index": file}


def picture_key(camera: str) -> str:
    """Return the name of the feature that has a camera's pictures; a name in a data set has no slash."""
    return f"observation.images.{camera.replace('/', '.')}"
