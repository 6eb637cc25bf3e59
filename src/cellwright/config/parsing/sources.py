"""Source files of a cell or a robot: collected for recordings, read within bounds, and joined as one text.

Their names form two trees: bundled files lie under `bundled/`, all others under `files/`. Each has its path on disk
relative to the others. Unpacked into a folder that way, the files find each other as before.
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
from cellwright.util.files import LFS_POINTER, is_lfs_pointer, open_to_read

MAX_FILE_BYTES = 64 << 20
"""Maximum size of a collected file [bytes]; larger ones are not read."""

_PACKAGE = Path(FOLDER)
_collecting: list[Sources] = []

MAX_BYTES = 512 * 1024
"""Maximum total size of the files of one trial."""
_LINE_END = re.compile(r"\r\n?|\n")
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


class Sources:
    """Collected files, by path."""

    def __init__(self) -> None:
        self._contents: dict[Path, bytes] = {}

    def add(self, path: Path, content: bytes | None = None) -> None:
        """Add a file with the content that was read, or with its present content; skip it if it cannot be read."""
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
        """Return the name of a collected file.

        Raises:
            KeyError: the file was not collected.
        """
        place = Path(os.path.abspath(path))
        if place not in self._contents:
            raise KeyError(str(path))
        return self._name(place)

    def packages(self) -> list[str]:
        """Names of the folders on the package path of ROS from which files were read."""
        listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
        folders = [Path(os.path.abspath(each)) for each in listed if each]
        return [self._name(each) for each in folders if any(place.is_relative_to(each) for place in self._contents)]

    def _name(self, place: Path) -> str:
        if place.is_relative_to(_PACKAGE):
            return f"bundled/{place.relative_to(_PACKAGE).as_posix()}"
        own = [each.parent for each in self._contents if not each.is_relative_to(_PACKAGE)]
        return f"files/{_below(place, own)}"


def _read(place: Path) -> bytes | None:
    """Return the content of a plain file; None if it is no plain file or cannot be read."""
    try:
        if not place.is_file() or place.stat().st_size > MAX_FILE_BYTES:
            return None
        return place.read_bytes()
    except (OSError, ValueError):
        return None


def _below(place: Path, folders: Sequence[Path]) -> str:
    """Return a path relative to the common parent of the folders; to the root if there is none, as on two drives."""
    try:
        return place.relative_to(os.path.commonpath(folders)).as_posix()
    except ValueError:
        return place.as_posix().replace(":", "").lstrip("/")


@contextmanager
def sources_collected() -> Iterator[Sources]:
    """Collect the files that are read in the context."""
    sources = Sources()
    _collecting.append(sources)
    try:
        yield sources
    finally:
        _collecting.remove(sources)


def note_source(path: Path, content: bytes | None = None) -> None:
    """Record that a file is read, with its content; without `content`, read the present one for that."""
    for sources in _collecting:
        sources.add(path, content)


def read_at_most(path: Path, max_bytes: int) -> bytes | None:
    """Return the bytes of a file; None if there are more than `max_bytes`.

    Raises:
        OSError: it cannot be read.
        ValueError: its name is no valid file name.
    """
    with open_to_read(path) as stream:
        content = stream.read(max_bytes + 1)
    if len(content) > max_bytes:
        return None
    note_source(path, content)
    return content


def reason(error: OSError | ValueError) -> str:
    """Return the reason why a file cannot be read, without its name."""
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


@dataclass(frozen=True, slots=True)
class Text:
    """Text of one file."""

    path: str
    content: str


class JoinedText:
    """Texts of several files, concatenated without so much as a line break between them."""

    def __init__(self, texts: Sequence[Text]) -> None:
        self._texts = tuple(texts)
        self.content = "".join(text.content for text in texts)
        self._starts: list[int] = []
        length = 0
        for text in texts:
            self._starts.append(length)
            length += len(text.content)
        self._places: dict[tuple[int, int], Place] = {}
        self._line_starts = [[0, *(match.end() for match in _LINE_END.finditer(text.content))] for text in texts]

    def place(self, index: int) -> Place:
        """Return the file and line of the character at `index`; positions behind the end belong to the last line."""
        index = max(0, min(index, len(self.content) - 1))
        file = max(bisect_right(self._starts, index) - 1, 0)
        line = bisect_right(self._line_starts[file], index - self._starts[file])
        # a line has many values, and all are at one place
        if (file, line) not in self._places:
            self._places[file, line] = Place(file, self._texts[file].path, line)
        return self._places[file, line]

    @property
    def has_content(self) -> bool:
        """True if the text has more than blanks, comments and marks of YAML documents."""
        lines = (line.strip() for line in self.content.removeprefix("\ufeff").splitlines())
        return any(line and line not in ("---", "...") and not line.startswith(("#", "%")) for line in lines)

    def glue_hint(self, place: Place) -> str:
        """Return a hint for problems on a line that the preceding file did not end, else an empty text."""
        if place.line != 1 or place.file == 0:
            return ""
        before = self._texts[place.file - 1]
        if not before.content or before.content.endswith(("\n", "\r")):
            return ""
        return f"; the last line of {before.path} has no line end, so this line continues it"


def read_texts(paths: Sequence[Path]) -> JoinedText:
    """Return the files as one text.

    Raises:
        DescriptionError: a file cannot be read, is too large, or is no UTF-8 text.
    """
    problems: list[Problem] = []
    texts: list[Text] = []
    remaining = MAX_BYTES
    for file, path in enumerate(paths):
        try:
            with open_to_read(path) as stream:
                data = stream.read(remaining + 1)
        except (OSError, ValueError) as error:
            problems.append(Problem(Place(file, str(path), 0), "", f"cannot be read: {reason(error)}"))
            continue
        if len(data) > remaining:
            message = f"the configuration exceeds {MAX_BYTES // 1024} KiB in total"
            problems.append(Problem(Place(file, str(path), 0), "", message))
            break
        remaining -= len(data)
        note_source(path, data)
        if is_lfs_pointer(data):
            problems.append(Problem(Place(file, str(path), 0), "", LFS_POINTER))
            continue
        decoded = _decoded(data, Place(file, str(path), 1), alone=len(paths) == 1)
        if isinstance(decoded, Problem):
            problems.append(decoded)
        else:
            texts.append(Text(str(path), decoded))
    if problems:
        raise DescriptionError(problems)
    return JoinedText(texts)


def _decoded(data: bytes, place: Place, *, alone: bool) -> str | Problem:
    """Decode bytes as UTF-8, or as UTF-16 for a single file that starts with its byte order mark."""
    encoding = "utf-16" if alone and data.startswith(_UTF16_MARKS) else "utf-8"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start) if encoding == "utf-8" else 1
        return Problem(Place(place.file, place.path, line), "", "not UTF-8 text; save the file as UTF-8")
