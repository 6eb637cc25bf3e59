"""Tables that fit the width of the console; no word and no number is broken in its middle."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.segment import Segments
from rich.table import Table
from rich.text import Text

from cellwright.util.errors import printable

FOLD: Mapping[str, Any] = {}
RIGHT: Mapping[str, Any] = {"justify": "right", "no_wrap": True}
WHOLE: Mapping[str, Any] = {"no_wrap": True}
"""Columns of a table: names that may be broken between their words, figures, words that stay whole."""

_MAX_WIDTH = 10_000  # columns

_WORDS = re.compile(r"(?:[+-]?\d[\d.]*\s+(?=[^\W\d]))?[^\s|]*(?:\||\s+|$)")  # a number stays beside its noun
_PIECES = re.compile(
    r"(?<=[/=])(?=.)"
    r"|(?<=[_,:])(?=[^\d\s])|(?<=\D[_,:])(?=\S)"  # not within 1_000 or 12:30
    r"|(?<=[.+])(?=[^\W\d])|(?<=[^\W\d]-)(?=[^\W\d])"  # not within 0.5, 1e+3 or -3
)


def pieces(text: str, width: int = 0) -> list[str]:
    """Split a line where it may be broken.

    That is between words, and words that are wider than `width` also behind `_`, `/`, `=` and the like.

    Example:
        >>> pieces("final01+kitter_sensors arm.gain=-0.25, 3 done", width=7)
        ['final01+', 'kitter_', 'sensors ', 'arm.', 'gain=', '-0.25, ', '3 done']
        >>> pieces("belt|gear_part_1", width=11)
        ['belt|', 'gear_part_1']
    """
    words = filter(None, _WORDS.findall(text))
    return [part for word in words for part in ([word] if len(word.rstrip()) <= width else _PIECES.split(word))]


@dataclass(frozen=True, slots=True)
class _Widths:
    """Widths of a column: unbroken, with its heading broken alone, and with everything broken."""

    whole: int
    of_cells: int
    least: int


class FittedTable:
    """Table that fits the width of the console.

    Where it is too wide, headings and then names are broken between their words, the longest first, and the gaps get
    narrower. If that is not enough, the table is wider than the console: see `print_table`.

    Args:
        columns: settings of each column, by heading: `FOLD`, `RIGHT` or `WHOLE`.
        rows: cells of each row; plain texts have no markup.
        settings: settings of rich's table.
    """

    def __init__(
        self,
        columns: Mapping[str, Mapping[str, Any]],
        rows: Iterable[Sequence[str | Text]],
        settings: Mapping[str, Any],
    ) -> None:
        self._columns = dict(columns)
        self._rows = [[_cell(each) for each in row] for row in rows]
        self._settings = {"box": box.SIMPLE_HEAD, "show_edge": False, "pad_edge": False, **settings}
        self._widths = []
        for number, (heading, column) in enumerate(columns.items()):
            cells = [row[number] for row in self._rows if number < len(row)]
            headings = [Text(heading)] if settings.get("show_header", True) else []
            self._widths.append(_widths(headings, cells, column))

    def fitted(self, console: Console, width: int) -> tuple[Table, int]:
        """Return the table for a width of the console, and the width that it takes."""
        settings, gaps = self._settings, 0
        for narrower in ({}, {"collapse_padding": True}, {"collapse_padding": True, "padding": (0, 1, 0, 0)}):
            settings = {**self._settings, **narrower}
            gaps = self._gaps(console, settings)
            if sum(each.least for each in self._widths) + gaps <= width:
                break
        widths = [each.whole for each in self._widths]
        for least in ([each.of_cells for each in self._widths], [each.least for each in self._widths]):
            while sum(widths) + gaps > width and (wide := [n for n, each in enumerate(widths) if each > least[n]]):
                widths[max(wide, key=lambda n: widths[n])] -= 1
        return self._table(settings, widths), sum(widths) + gaps

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        gaps = self._gaps(console, self._settings)
        least, whole = (sum(each) + gaps for each in zip(*((w.least, w.whole) for w in self._widths), strict=True))
        return Measurement(least, whole).with_maximum(options.max_width)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        table, needed = self.fitted(console, options.max_width)
        yield Segments(console.render(table, options.update(width=max(needed, options.max_width))))

    def _gaps(self, console: Console, settings: Mapping[str, Any]) -> int:
        widths = [each.whole for each in self._widths]
        empty = self._table(settings, widths, is_empty=True)
        options = console.options.update(width=_MAX_WIDTH)
        return Measurement.get(console, options, empty).maximum - sum(widths)

    def _table(self, settings: Mapping[str, Any], widths: Sequence[int], *, is_empty: bool = False) -> Table:
        table = Table(**settings)
        for (heading, column), width in zip(self._columns.items(), widths, strict=True):
            table.add_column(_broken(Text(heading), width), **{**column, "width": width, "no_wrap": True})
        for row in [] if is_empty else self._rows:
            table.add_row(*(_broken(cell, width) for cell, width in zip(row, widths, strict=False)))
        return table


def table(
    columns: Mapping[str, Mapping[str, Any]], rows: Iterable[Sequence[str | Text]], **settings: Any
) -> FittedTable:
    """Return a table with a line below its headings; see `FittedTable`."""
    return FittedTable(columns, rows, settings)


def print_table(console: Console, table: FittedTable) -> None:
    """Print a table without the blanks that fill up its lines; it is wider than the console if it has to be."""
    with console.capture() as capture:
        console.print(table, crop=False)
    for line in capture.get().splitlines():
        console.file.write(f"{line.rstrip()}\n")


def _cell(content: str | Text) -> Text:
    return Text(printable(content)) if isinstance(content, str) else content


def _widths(headings: Sequence[Text], cells: Sequence[Text], column: Mapping[str, Any]) -> _Widths:
    given = column.get("min_width", 0)
    whole = max((line.cell_len for cell in (*headings, *cells) for line in cell.split()), default=given)
    least = whole if column.get("no_wrap") else max(map(_least, (*headings, *cells)), default=given)
    of_cells = max((line.cell_len for cell in cells for line in cell.split()), default=given)
    return _Widths(max(whole, given), max(of_cells, least, given), max(least, given))


def _least(cell: Text) -> int:
    """Return the width of the longest piece of a cell."""
    return max((Text(piece.rstrip()).cell_len for line in cell.plain.splitlines() for piece in pieces(line)), default=0)


def _broken(cell: Text, width: int) -> Text:
    """Return a cell in lines of a width, as far as its pieces allow."""
    return Text("\n").join(part for line in cell.split() for part in _lines(line, width))


def _lines(line: Text, width: int) -> Iterator[Text]:
    """Yield the lines of one line of a cell, as long as they may be."""
    begin = end = 0
    for piece in pieces(line.plain, width):
        stop = end + len(piece)
        if end > begin and line[begin:stop].cell_len - (len(piece) - len(piece.rstrip())) > width:
            yield _stripped(line[begin:end])
            begin = end
        end = stop
    yield _stripped(line[begin:])


def _stripped(line: Text) -> Text:
    line.rstrip()
    return line
