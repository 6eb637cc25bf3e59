"""Check of the videos of a data set: place of each episode, and number, times, size and rate of the pictures."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import av

from cellwright.recording.dataset.described import Description, Feature, unreadable
from cellwright.recording.dataset.layout import VIDEO_COLUMNS, VIDEO_PATH

_TOLERANCE = 1e-4  # [s], that of LeRobot's readers


def check_videos(described: Description, episodes: list[dict[str, Any]], problems: list[str]) -> None:
    """Append what is wrong with the videos, by the rows of the table of episodes; none are judged without rows."""
    for key, feature in described.videos.items():
        frames: dict[Path, int] = {}
        for number, row in enumerate(episodes):
            chunk, file, begin, end = (row[f"videos/{key}/{name}"] for name in VIDEO_COLUMNS)
            name = VIDEO_PATH.format(video_key=key, chunk_index=chunk, file_index=file)
            before = frames.setdefault(described.folder / name, 0)
            times = {"from": (begin, before), "to": (end, before + row["length"])}
            problems += [
                f"{described.folder / name}: episode {number}: {side}_timestamp must be {frame / described.rate:.4f}, "
                f"by the frames before it (got {time:.4f})"
                for side, (time, frame) in times.items()
                if abs(time - frame / described.rate) > _TOLERANCE
            ]
            frames[described.folder / name] += row["length"]
        for path, count in frames.items():
            problems += [f"{path}: {text}" for text in _wrong(path, count, feature, described.rate)]
        if episodes:
            others = sorted({*(described.folder / "videos" / key).glob("*/*")} - {*frames})
            problems += [f"{path}: is of no episode" for path in others]


def _wrong(path: Path, count: int, feature: Feature, rate: int) -> list[str]:
    try:
        with av.open(str(path)) as file:
            if not file.streams.video:
                return ["has no video stream"]
            stream = file.streams.video[0]
            size, own_rate = (stream.height, stream.width), stream.average_rate
            times = sorted(
                packet.pts * packet.time_base
                for packet in file.demux(stream)
                if packet.pts is not None and packet.time_base is not None
            )
            file.seek(0)
            first = next(file.decode(stream), None)
    except (av.FFmpegError, OSError, ValueError) as error:
        return [unreadable(error)]
    found = []
    if size != feature.shape[:2]:
        expected = f"{feature.shape[1]} x {feature.shape[0]}"
        found.append(f"pictures must be {expected} pixels, as in info.json (got {size[1]} x {size[0]})")
    if own_rate != rate:
        found.append(f"must have the {rate} pictures per second of info.json (got {own_rate})")
    if len(times) != count:
        found.append(f"must have a picture for each frame of its episodes, {count} (got {len(times)})")
    bad = [k for k, time in enumerate(times) if abs(time - Fraction(k, rate)) > _TOLERANCE]
    if bad:
        found.append(f"picture {bad[0]} must be at {bad[0] / rate:.4f} s (got {float(times[bad[0]]):.4f})")
    if first is None:
        found.append("has no picture that can be decoded")
    return found
