"""Output files of a recording: written as MCAP, and converted to other formats at its end."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from cellwright.util.errors import CellwrightError, UsageError

MCAP, BAG = ".mcap", ".bag"

KINDS = (MCAP, BAG)
"""Suffixes of the files that can be written."""


class RecordingFiles:
    """Output files of a recording.

    A ROS 1 bag has no form that survives a kill. A bag that is requested without an MCAP file is recorded as
    `NAME.bag.mcap` until the end; after a kill, `cellwright replay` makes the bag of that.

    Args:
        paths: the requested files; suffixes give the formats.
        report: called with a line about a file that could not be written.

    Raises:
        UsageError: two files of one format, or one of an unknown format.
    """

    def __init__(self, paths: Sequence[Path], *, report: Callable[[str], None] = lambda _line: None) -> None:
        by_kind: dict[str, Path] = {}
        for path in paths:
            kind = path.suffix.lower()
            if kind not in KINDS:
                raise UsageError(
                    f"{path}: unknown recording format (got {path.suffix!r}); use a name such as run.mcap or run.bag"
                )
            if kind in by_kind:
                raise UsageError(f"{path}: only one {kind} file is possible (also got {by_kind[kind]}); leave one out")
            by_kind[kind] = path
        self._report = report
        self._bag = by_kind.get(BAG)
        self._is_temporary = MCAP not in by_kind
        stand_in = None if self._bag is None else self._bag.with_name(f"{self._bag.name}{MCAP}")
        file = by_kind.get(MCAP, stand_in)
        if file is None:
            raise UsageError("record: no file given; give one, such as run.mcap")
        self.path: Path = file
        """The MCAP file."""
        self.is_whole = True
        """True if all requested files could be written."""
        self.written: list[Path] = []
        """The files that exist at the end."""

    def finish(self, written: Sequence[Path]) -> None:
        """Make the other requested files of the MCAP files that were written, one a run."""
        self.written += written
        if self._bag is None:
            return
        from cellwright.recording.format.bag import write_bag

        for number, path in enumerate(written, start=1):
            bag = self._bag if number == 1 else self._bag.with_stem(f"{self._bag.stem}_{number}")
            try:
                write_bag(path, bag)
            except CellwrightError as error:
                self.is_whole = False
                self._report(f"{error}; the recording is in {path}")
                continue
            if self._is_temporary:
                with suppress(OSError):
                    path.unlink()
                self.written.remove(path)
            self.written.append(bag)
