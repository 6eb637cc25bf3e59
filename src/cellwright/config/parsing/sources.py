"""Source files of a cell or a robot: collected for recordings, read within bounds, and joined as one text.

They are named in two trees: what comes with Cellwright under `bundled/`, everything else under `files/`, each as it
lies on disk relative to the others. Put back into a folder in that order, the files find each other as before.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.config.parsing.tree import Place, Problem
from cellwright.util.errors import DescriptionError
from cellwright.util.files import open_to_read

LARGEST = 64 << 20
"""A file that is larger [bytes] is not collected; none that is read may be."""

_PACKAGE = Path(FOLDER)
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
            return f"bundled/{place.relative_to(_PACKAGE).as_posix()}"
        own = [each.parent for each in self._contents if not each.is_relative_to(_PACKAGE)]
        return f"files/{_below(place, own)}"


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


def read_at_most(path: Path, most: int) -> bytes | None:
    """The bytes of a file; None where there are more than `most` of them.

    Raises:
        OSError: it cannot be read.
        ValueError: it has a name that no file can have.
    """
    with open_to_read(path) as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        return None
    note_source(path, content)
    return content


def reason(error: OSError | ValueError) -> str:
    """Why a file cannot be read, without its name."""
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


MAX_BYTES = 512 * 1024
"""Largest size of all files of one trial together."""

_LINE_END = re.compile(r"\r\n?|\n")
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True, slots=True)
class Text:
    """The text of one file."""

    path: str
    content: str


class JoinedText:
    """The texts of several files, one directly after the other: not even a line break comes between them."""

    def __init__(self, texts: Sequence[Text]) -> None:
        self._texts = tuple(texts)
        self.content = "".join(text.content for text in texts)
        self._starts: list[int] = []
        length = 0
        for text in texts:
            self._starts.append(length)
            length += len(text.content)
        self._line_starts = [[0, *(match.end() for match in _LINE_END.finditer(text.content))] for text in texts]

    def place(self, index: int) -> Place:
        """The file and line of the character at `index`; what lies behind the end belongs to the last line."""
        index = max(0, min(index, len(self.content) - 1))
        file = max(bisect_right(self._starts, index) - 1, 0)
        line = bisect_right(self._line_starts[file], index - self._starts[file])
        return Place(file, self._texts[file].path, line)

    def glue_hint(self, place: Place) -> str:
        """A remark for problems on a line that the file before did not end, else nothing."""
        if place.line != 1 or place.file == 0:
            return ""
        before = self._texts[place.file - 1]
        if not before.content or before.content.endswith(("\n", "\r")):
            return ""
        return f"; {before.path} does not end its last line, so this line goes on there"


def read_texts(paths: Sequence[Path]) -> JoinedText:
    """The files as one text.

    Raises:
        DescriptionError: a file cannot be read, is too large, or is no UTF-8 text.
    """
    problems: list[Problem] = []
    texts: list[Text] = []
    left = MAX_BYTES
    for file, path in enumerate(paths):
        try:
            with open_to_read(path) as stream:
                data = stream.read(left + 1)
        except (OSError, ValueError) as error:
            problems.append(Problem(Place(file, str(path), 0), "", f"cannot be read: {reason(error)}"))
            continue
        if len(data) > left:
            message = f"more than {MAX_BYTES // 1024} KiB of configuration"
            problems.append(Problem(Place(file, str(path), 0), "", message))
            break
        left -= len(data)
        note_source(path, data)
        decoded = _decoded(data, Place(file, str(path), 1), alone=len(paths) == 1)
        if isinstance(decoded, Problem):
            problems.append(decoded)
        else:
            texts.append(Text(str(path), decoded))
    if problems:
        raise DescriptionError(problems)
    return JoinedText(texts)


def _decoded(data: bytes, place: Place, *, alone: bool) -> str | Problem:
    """The bytes as text: UTF-8, or UTF-16 for a file that stands alone and has its mark in front."""
    encoding = "utf-16" if alone and data.startswith(_UTF16_MARKS) else "utf-8"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start) if encoding == "utf-8" else 1
        return Problem(Place(place.file, place.path, line), "", "not UTF-8 text; save the file as UTF-8")
