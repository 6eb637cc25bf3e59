"""The contents of files, of which no more is read than was asked for: some never end."""

from __future__ import annotations

from pathlib import Path

from cellwright.config.parsing.sources import note_source
from cellwright.util.atomic_file import open_to_read


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
