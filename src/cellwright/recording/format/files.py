"""The files that a recording is asked to be in: it is written as MCAP, and turned into others when it has ended."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from cellwright.util.errors import CellwrightError, UsageError

MCAP, BAG = ".mcap", ".bag"

KINDS = (MCAP, BAG)
"""Suffixes of the files that can be asked for."""


class RecordingFiles:
    """Where a recording goes.

    A ROS 1 bag has no form that outlives a kill: where one is asked for and no MCAP file, such a file stands in for it
    until the end, `NAME.bag.mcap`; after a kill `cellwright replay` makes the bag of it.

    Args:
        paths: what was asked for; the suffixes say of which kind.
        report: takes a line about a file that could not be written.

    Raises:
        UsageError: two of a kind, or one of an unknown kind.
    """

    def __init__(self, paths: Sequence[Path], *, report: Callable[[str], None] = lambda _line: None) -> None:
        by_kind: dict[str, Path] = {}
        for path in paths:
            kind = path.suffix.lower()
            if kind not in KINDS:
                raise UsageError(f"{path}: a recording is a file such as run.mcap or run.bag")
            if kind in by_kind:
                raise UsageError(f"{path}: one recording of a kind is enough, and {by_kind[kind]} is there already")
            by_kind[kind] = path
        self._report = report
        self._bag = by_kind.get(BAG)
        self._is_temporary = MCAP not in by_kind
        stand_in = None if self._bag is None else self._bag.with_name(f"{self._bag.name}{MCAP}")
        file = by_kind.get(MCAP, stand_in)
        if file is None:
            raise UsageError("a recording needs a file, such as run.mcap")
        self.path: Path = file
        """The MCAP file."""
        self.is_whole = True
        """Whether all that were asked for could be written."""
        self.written: list[Path] = []
        """The files that are there when all is over."""

    def finish(self, written: Sequence[Path]) -> None:
        """Make what else was asked for of the MCAP files that were written, one a run."""
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
                self._report(f"{error}; what was recorded is in {path}")
                continue
            if self._is_temporary:
                with suppress(OSError):
                    path.unlink()
                self.written.remove(path)
            self.written.append(bag)
