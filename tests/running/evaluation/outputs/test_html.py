"""Tests of the frame of an evaluation's pages: nothing that a program has chosen is markup."""

from cellwright.running.evaluation.outputs.html import document, escape, table


def test_texts_are_no_markup_and_hide_nothing() -> None:
    assert escape("<b>\u202e&") == "&lt;b&gt;\\u202e&amp;"


def test_page_has_title_style_and_versions() -> None:
    page = document("a < b", "<p>body</p>", ".mine {}")
    assert "<title>a &lt; b</title>" in page
    assert ".mine {}</style>" in page
    assert page.index("<p>body</p>") < page.index("cellwright ")


def test_table_has_a_head_for_each_column() -> None:
    head = '<tr><th class="">a&amp;b</th><th class="n">c</th></tr>'
    assert table([("a&b", ""), ("c", "n")], ["<tr></tr>"]) == (
        f"<table><thead>{head}</thead><tbody><tr></tr></tbody></table>"
    )
