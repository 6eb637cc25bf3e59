"""What is seen while a benchmark is taken: on a terminal a line that moves, elsewhere plain lines."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console

from benchmarks.figures import Tell
from cellwright.cli.output import progress_bar


@contextmanager
def telling(console: Console, title: str) -> Iterator[Tell]:
    """What takes lines about a benchmark, as long as it lasts."""
    with progress_bar(console, title, None) as moving:

        def tell(line: str) -> None:
            if moving is None:
                console.print(f"{title}: {line}", markup=False, soft_wrap=True)
            else:
                moving(None, line)

        yield tell
