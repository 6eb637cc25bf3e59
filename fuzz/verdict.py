"""Required form of refusals, for every reader."""

from __future__ import annotations

from collections.abc import Iterable

from cellwright.util.errors import DescriptionError

MAX_LINES = 2000
"""Largest number of lines of use to a reader."""
MAX_LINE_LENGTH = 2000
"""Longest line of a refusal, in characters, the file's own path left out."""


class FindingError(Exception):
    """An outcome that is no use to a user."""


def check_lines(lines: Iterable[object], paths: Iterable[str]) -> None:
    """Check lines about files: each names its file, is one line that a terminal can show, and not too long.

    Raises:
        FindingError: one of them does not.
    """
    known = tuple(paths)
    texts = list(map(str, lines))
    for line in texts:
        path = next((path for path in known if line.startswith(f"{path}:")), None)
        if path is None:
            raise FindingError(f"no file is named: {line!r:.200}")
        if not line.isprintable() or not line.removeprefix(f"{path}:").strip():
            raise FindingError(f"a line that cannot be read: {line!r:.200}")
        if len(line) > MAX_LINE_LENGTH + len(path):
            raise FindingError(f"a line of {len(line)} characters: {line!r:.200}")
    if len(texts) > MAX_LINES:
        raise FindingError(f"{len(texts)} lines")


def check_refusal(error: DescriptionError, *paths: str) -> None:
    """Check a refusal of files: at least one problem, and lines in the required form.

    Raises:
        FindingError: there is something wrong with it.
    """
    if not error.problems:
        raise FindingError("a refusal without a reason")
    check_lines((*error.problems, *error.warnings), paths)
