"""Several files read as one text, as the original joined them, and the way back from the text to file and line."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.config.parsing.problems import Place, Problem
from cellwright.config.parsing.sources import note_source
from cellwright.util.atomic_file import open_to_read
from cellwright.util.errors import DescriptionError

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
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            problems.append(Problem(Place(file, str(path), 0), "", f"cannot be read: {reason}"))
            continue
        if len(data) > left:
            problems.append(
                Problem(Place(file, str(path), 0), "", f"more than {MAX_BYTES // 1024} KiB of configuration")
            )
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
