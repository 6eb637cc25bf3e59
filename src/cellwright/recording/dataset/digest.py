"""Digests of recordings: a data set says with them which recording each episode is of."""

import hashlib
from pathlib import Path

from cellwright.util.files import open_to_read


def sha256_of(recording: Path) -> str:
    """Return the SHA-256 of a recording, as sha256sum prints it.

    Args:
        recording: a file, or the folder of a bag, of which the list that sha256sum prints of its files is taken.

    Raises:
        OSError: it cannot be read.
    """
    if recording.is_dir():
        files = sorted(path for path in recording.rglob("*") if not path.is_dir())
        lines = (f"{sha256_of(path)}  {path.relative_to(recording).as_posix()}\n" for path in files)
        return hashlib.sha256("".join(lines).encode()).hexdigest()
    with open_to_read(recording) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
