"""Keys of cells: strict tables, each entry with its text."""

import pytest

from cellwright.config.layout import keys
from cellwright.config.parsing.entries import texts
from cellwright.config.parsing.reader import Keys

TABLES = {name: value for name, value in vars(keys).items() if isinstance(value, Keys)}


@pytest.mark.parametrize("name", TABLES)
def test_table_is_strict_and_each_entry_has_a_reader_and_a_text(name: str) -> None:
    table = TABLES[name]
    assert table.strict
    assert all((*table.required.values(), *table.optional.values()))
    assert texts(table.texts).keys() == {*table.names}
