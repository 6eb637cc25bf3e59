"""What `--record` asks for, on whatever is run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from cellwright.cli import lines, options
from cellwright.config.parsing.sources import sources_collected
from cellwright.recording.format.files import KINDS, RecordingFiles
from cellwright.running.run import RecordOptions

T = TypeVar("T")


def wanted(paths: Sequence[Path] | None, **about: Any) -> RecordOptions | None:
    """How a run is to be recorded; None where it is not.

    Args:
        paths: files that were asked for.
        about: what is known of the run besides.

    Raises:
        UsageError: a file cannot be written, or is of no kind of recording.
    """
    if not paths:
        return None
    for path in paths:
        kind = path.suffix.lower()
        if kind not in KINDS:
            options.refuse(f"--record {path}: give a file such as run.mcap, or run.bag for the tools of ROS 1")
        options.output_file("--record", path, kind)
    RecordingFiles(paths)
    return RecordOptions(paths, about, report=lines.warn)


def with_sources(
    record: RecordOptions | None, read: Callable[[], T], files: Callable[[T], Sequence[Path]]
) -> tuple[T, RecordOptions | None]:
    """Read what is to run; a recording of it will hold the files that it is read from.

    Args:
        record: how it is recorded, if it is.
        read: reads it.
        files: those that were named, in their order, of what was read.
    """
    if record is None:
        return read(), None
    with sources_collected() as sources:
        found = read()
    return found, replace(record, sources=sources, files=files(found))


def of_turn(record: RecordOptions | None, number: int) -> RecordOptions | None:
    """How the n-th run of a course is recorded: each has files of its own."""
    if record is None or number == 1:
        return record
    return replace(record, paths=[path.with_stem(f"{path.stem}_{number}") for path in record.paths])
