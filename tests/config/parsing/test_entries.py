"""Texts on entries of configuration files."""

import pytest

from cellwright.config.parsing.entries import EntryText, tables, texts


@pytest.mark.parametrize(
    ("text", "description"),
    [
        (EntryText("seconds", "end of the trial", "500"), "End of the trial (seconds); default: 500."),
        (EntryText("`{x}`", "sensors, see [below](#sensors)", "none"), "Sensors (`{x}`); default: none."),
        (EntryText("text", "its [type](types.md)", "required"), "Its type (text); required."),
        (EntryText("list", "after the last &#124;", "see below"), "After the last | (list)."),
    ],
)
def test_description_is_a_line_without_links(text: EntryText, description: str) -> None:
    assert text.description == description


def test_texts_have_last_words_of_names() -> None:
    assert texts("gains").keys() == {"p", "d", "i", "i_clamp"}
    assert texts("no such table") == {}


def test_each_text_is_complete() -> None:
    assert all(all(text) for rows in tables().values() for text in rows.values())
