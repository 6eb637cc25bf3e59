from pathlib import Path

import pytest

from tools import prose

PAGE = f"""
{prose.TABLE}

| given up | write |
|---|---|
| guest, guests | client |
| so many | a number |

## After

| not | this |
"""


def found(tmp_path: Path, text: str, name: str = "module.py") -> list[str]:
    """The findings of a file, without path."""
    path = tmp_path / name
    path.write_text(text)
    report = prose.Report()
    prose.check(path, prose.given_up_words(PAGE), report)
    return [f"{each.line}: {each.text}" for each in report.findings]


def test_given_up_words_are_read_from_table_only() -> None:
    assert prose.given_up_words(PAGE) == {"guest": "client", "guests": "client", "so many": "a number"}


def test_page_without_table_is_refused() -> None:
    with pytest.raises(ValueError, match="add it with a table"):
        prose.given_up_words("# Glossary\n")


def test_glossary_has_table_of_given_up_words() -> None:
    assert prose.given_up_words(prose.GLOSSARY.read_text())["anew"] == "again, or new"


@pytest.mark.parametrize(
    "line",
    [
        '"""The guest."""',
        "# the guest",
        "guest = 1",
        "def call(guest): ...",
        "class GuestList: ...",
        'print("the guest is late")',
        "x.guest = 1",
    ],
)
def test_given_up_word_in_prose_or_name_is_found(line: str, tmp_path: Path) -> None:
    (only,) = found(tmp_path, line + "\n")
    assert only.startswith("1: ")
    assert "is given up; write client" in only


@pytest.mark.parametrize("line", ["import guest", "x = guest()", "x = {'guest': 1}", "# noqa: guest", "guesthouse = 1"])
def test_given_up_word_in_code_of_others_is_ignored(line: str, tmp_path: Path) -> None:
    assert not found(tmp_path, line + "\n")


def test_opening_with_question_word_is_found(tmp_path: Path) -> None:
    text = '"""What it is."""\n\n\ndef f():\n    """Whether it rains."""\n\n\ndef g():\n    """Whatever."""\n'
    assert [each.split(":")[0] for each in found(tmp_path, text)] == ["1", "5"]
    entry = (
        '"""Part.\n\nArgs:\n    size: how large.\n    more: all of what is left.\n"""\nSIZE = 1\n"""Which size."""\n'
    )
    assert [each.split(":")[0] for each in found(tmp_path, entry)] == ["4", "8"]


def test_long_sentence_in_docstring_or_page_is_found(tmp_path: Path) -> None:
    long = " ".join(["word"] * 36) + "."
    (only,) = found(tmp_path, f'"""Title.\n\n{long}\n"""\n')
    assert "36 words (at most 35)" in only
    assert len(found(tmp_path, f"# Title\n\n{long}\n", "page.md")) == 1
    assert not found(tmp_path, f"# Title\n\n```\n{long}\n```\n\n| {long} |\n\n<!-- {long} -->\n", "page.md")


def test_code_in_page_is_ignored(tmp_path: Path) -> None:
    assert not found(tmp_path, "The `guest` of\n\n```python\nguest = 1\n```\n", "page.md")
    (only,) = found(tmp_path, "A line.\nSo many guests.\n".replace("guests", "parts"), "page.md")
    assert only.startswith("2: 'So many' is given up")


def test_sentences_end_at_full_stops_and_entries() -> None:
    text = "First one. Second, e.g. this\ngoes on.\n\nArgs:\n    name: of it.\n    size: how large [m].\n- an item\n"
    assert [each.split()[0] for each in prose.sentences(text)] == ["First", "Second,", "Args:", "name:", "size:", "-"]


@pytest.mark.parametrize(
    ("name", "skipped"), [("tests/data/help/run.txt", True), ("docs/glossary.md", True), ("docs/score.md", False)]
)
def test_text_of_others_is_skipped_also_where_it_is_named(name: str, skipped: bool) -> None:
    assert prose.is_skipped(prose.ROOT / name) is skipped


@pytest.mark.parametrize("name", ["Makefile", "install"])
def test_comments_of_scripts_are_checked_and_their_commands_are_not(name: str, tmp_path: Path) -> None:
    text = "#!/bin/guest\nguest: # the guest\n\techo guest\n\t# for a guest\n"
    assert found(tmp_path, text, name) == ["4: 'guest' is given up; write client"]


def test_rows_in_comments_of_scripts_are_sentences_of_their_own(tmp_path: Path) -> None:
    row = " ".join(["word"] * 20)
    assert found(tmp_path, f"# alone  {row}\n# busy   {row}\n", "run") == []
    (only,) = found(tmp_path, f"# {row}\n# {row}\n", "run")
    assert "a sentence of 40 words" in only


def test_scripts_of_the_project_are_read() -> None:
    names = {path.name for path in prose.files()}
    assert names >= {"Makefile", "Dockerfile", "install-ros1", "packages.sh", "run"}
