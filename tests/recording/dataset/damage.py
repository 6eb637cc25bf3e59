"""Damage to the tables of data sets, for tests of those who are to find it."""

from collections.abc import Callable
from typing import Any

import pyarrow

Change = Callable[[Any], Any]
"""Returns a table, or the values of a column, changed."""


def reversed_rows(table: Any) -> Any:
    return table.take(pyarrow.array(range(table.num_rows)[::-1]))


def without(name: str) -> Change:
    return lambda table: table.drop_columns([name])


def put(name: str, change: Change) -> Change:
    """Change the values of a column."""
    return lambda table: table.set_column(
        table.column_names.index(name), name, pyarrow.array(change(table[name].to_pylist()), table[name].type)
    )


def replaced(row: int, value: Any) -> Change:
    return lambda values: [*values[:row], value, *values[row + 1 :]]


def as_lists(table: Any) -> Any:
    """Give a scalar column the type of lists with one value."""
    values = table["next.reward"].combine_chunks()
    column = pyarrow.FixedSizeListArray.from_arrays(values, 1)
    return table.set_column(table.column_names.index("next.reward"), "next.reward", column)


def with_another(table: Any) -> Any:
    return table.append_column("extra", pyarrow.array(range(table.num_rows)))


def swapped(table: Any) -> Any:
    """Exchange two neighbouring rows in one episode."""
    order = [*range(table.num_rows)]
    order[3], order[4] = 4, 3
    return table.take(pyarrow.array(order))
