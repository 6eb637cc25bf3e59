"""The page with all figures, as Markdown."""

from __future__ import annotations

import datetime
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence

from benchmarks import words
from benchmarks.taking import Taken

WIDTH = 120
"""Of a line of text."""

HEAD = """# Benchmarks

What Cellwright costs, measured. This page is written by a command and not by hand: `make bench`, which is
`python -m benchmarks --write docs/benchmarks.md`. It takes the figures on your machine, and exits with status 1 if one
is outside its bound.

## How to read it

- **Ratios travel, times do not.** A ratio (`x`) compares two things measured in one run on one machine, and comes out
  much the same elsewhere. A time is that of the machine below, in the state that it was in.
- **Bounds** are what the project holds itself to. A figure without one is there to be known.
- Of repeats the best counts, unless a note says otherwise: what else a machine does can only make things slower. The
  repeats of things that are compared are taken in turn.
- What is skipped lacks something on this machine, and says what.
- To see where the time goes: `python -m cProfile -o FILE -m python -m benchmarks NAME`.
"""


def page(taken: Sequence[Taken], machine: Mapping[str, str], day: datetime.date, *, quick: bool = False) -> str:
    """The whole page.

    Args:
        taken: the benchmarks, in the order in which they are to stand.
        machine: what they were taken on.
        day: when.
        quick: whether the figures are rough, which is then said.
    """
    rough = (
        ["", "**These figures are rough:** taken with `--quick`, they only show that everything works."]
        if quick
        else []
    )
    about = [("date", day.isoformat()), *machine.items()]
    lines = [HEAD.rstrip(), *rough, "", "## The machine", "", *table(("", ""), about)]
    for each in taken:
        lines += ["", f"## {each.benchmark.title}", *_section(each, judged=not quick)]
    return "\n".join(lines) + "\n"


def _section(taken: Taken, *, judged: bool) -> Iterator[str]:
    for paragraph in (f"`python -m benchmarks {taken.benchmark.name}`", *taken.benchmark.about()):
        yield from ("", *textwrap.wrap(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False))
    if taken.figures:
        yield ""
        rows = [
            (
                figure.what,
                words.value(figure),
                words.bound(figure),
                words.verdict(figure) if judged else "",
                figure.note,
            )
            for figure in taken.figures
        ]
        yield from table(("figure", "value", "bound", "", "note"), rows)
    for word, reason in (("Skipped", taken.skipped), ("Failed", taken.failed)):
        if reason:
            yield from ("", f"{word}: {cell(reason)}.")


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table of Markdown, a line at a time."""
    yield _row(heads)
    yield "|" + "---|" * len(heads)
    yield from map(_row, rows)


def _row(cells: Sequence[str]) -> str:
    return "|" + "|".join(f" {cell(text)} " if text else " " for text in cells) + "|"


def cell(text: str) -> str:
    """A text as it can stand in a cell: on one line, and without what would end it."""
    return " ".join(text.split()).replace("|", "\\|")
