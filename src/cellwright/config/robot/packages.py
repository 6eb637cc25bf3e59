"""Finds ROS packages on disk, with or without ROS: robots refer to their meshes and parts by the package's name."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from cellwright.config.parsing.sources import note_source

_MOST_READ = 10_000  # of a package's manifest, whose name stands near its beginning [bytes]
_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")


def package_folders(name: str, path: Path) -> Iterator[Path]:
    """Where a package may be, the likeliest place first; not all of them exist.

    First come the folders above the file that asks: one that is called so, on disk or in its `package.xml`, or a
    neighbour of one. Then those that the environment of ROS names.

    Args:
        name: of the package.
        path: the file that asks for it.
    """
    for folder in path.resolve().parents:
        if folder.name == name or _declared_name(folder) == name:
            yield folder
        yield folder / name
    for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) / name
            if Path(entry).name == name:
                yield Path(entry)
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) / "share" / name


def _declared_name(folder: Path) -> str | None:
    try:
        with (folder / "package.xml").open("rb") as stream:
            text = stream.read(_MOST_READ).decode("utf-8", "replace")
    except (OSError, ValueError):
        return None
    note_source(folder / "package.xml")
    found = _NAME.search(text)
    return found[1] if found else None
