"""The files that a recording carries, put into a folder as they lay beside each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from cellwright.util.errors import RecordingError


@contextmanager
def unpacked(sources: Mapping[str, bytes]) -> Iterator[Path]:
    """A folder with these files in it, by their names; it is gone afterwards.

    Raises:
        RecordingError: a name leads out of the folder, or is none that a file can have here.
    """
    with TemporaryDirectory(prefix="cellwright-") as made:
        folder = Path(made)
        for name, content in sources.items():
            path = inside(folder, name)
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            except (OSError, ValueError) as error:
                raise RecordingError(f"a file {name!r:.80} in the recording cannot be unpacked: {error}") from None
        yield folder


def inside(folder: Path, name: object) -> Path:
    """The path of a named file in the folder.

    Raises:
        RecordingError: it would be somewhere else.
    """
    if isinstance(name, str) and name and "\\" not in name and ":" not in name:
        parts = PurePosixPath(name).parts
        if ".." not in parts and not PurePosixPath(name).is_absolute():
            return folder.joinpath(*parts)
    raise RecordingError(f"a file {name!r:.80} in the recording has a name that it cannot have")
