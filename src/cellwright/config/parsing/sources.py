"""The files that a cell or a robot is read from, collected while they are read, so that a recording can hold them.

They are named in two trees: what comes with Cellwright under `bundled/`, everything else under `files/`, each as it
lies on disk relative to the others. Put back into a folder in that order, the files find each other as before.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cellwright

LARGEST = 64 << 20
"""A file that is larger [bytes] is not collected; none that is read may be."""

BUNDLED, OWN = "bundled", "files"

_PACKAGE = Path(os.path.abspath(cellwright.__file__)).parent
_collecting: list[Sources] = []


class Sources:
    """Files, by where they lie."""

    def __init__(self) -> None:
        self._contents: dict[Path, bytes] = {}

    def add(self, path: Path, content: bytes | None = None) -> None:
        """Take a file in: what was read of it, or as it is now; what cannot be read is left out."""
        place = Path(os.path.abspath(path))
        if place in self._contents:
            return
        if content is None:
            content = _read(place)
        if content is not None:
            self._contents[place] = content

    def files(self) -> dict[str, bytes]:
        """Contents by name."""
        return {self._name(place): content for place, content in self._contents.items()}

    def name(self, path: Path) -> str:
        """The name of a file that was collected.

        Raises:
            KeyError: it was not.
        """
        place = Path(os.path.abspath(path))
        if place not in self._contents:
            raise KeyError(str(path))
        return self._name(place)

    def packages(self) -> list[str]:
        """Names of the folders in which ROS looks for packages, of those that something was read from."""
        listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
        folders = [Path(os.path.abspath(each)) for each in listed if each]
        return [self._name(each) for each in folders if any(place.is_relative_to(each) for place in self._contents)]

    def _name(self, place: Path) -> str:
        if place.is_relative_to(_PACKAGE):
            return f"{BUNDLED}/{place.relative_to(_PACKAGE).as_posix()}"
        own = [each.parent for each in self._contents if not each.is_relative_to(_PACKAGE)]
        return f"{OWN}/{_below(place, own)}"


def _read(place: Path) -> bytes | None:
    """The content of a plain file; None where it is another, or cannot be read."""
    try:
        if not place.is_file() or place.stat().st_size > LARGEST:
            return None
        return place.read_bytes()
    except (OSError, ValueError):
        return None


def _below(place: Path, folders: Sequence[Path]) -> str:
    """A path from the folder that all of these have in common; from the root where they have none, as on two drives."""
    try:
        return place.relative_to(os.path.commonpath(folders)).as_posix()
    except ValueError:
        return place.as_posix().replace(":", "").lstrip("/")


@contextmanager
def sources_collected() -> Iterator[Sources]:
    """Collect the files that are read inside."""
    sources = Sources()
    _collecting.append(sources)
    try:
        yield sources
    finally:
        _collecting.remove(sources)


def note_source(path: Path, content: bytes | None = None) -> None:
    """Say that a file is read, and what is in it; without a content it is read for that, as it is now."""
    for sources in _collecting:
        sources.add(path, content)
