"""Nothing in the documentation goes unlooked at: a block of commands or code is run by a test, or says why it is not.

What is not run is at least read: every command of Cellwright's own, in blocks and in running text, has to be one that
the command line takes.
"""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer

from cellwright.cli.main import app
from tests.docs import test_how_to, test_lesson, test_ros1_page, test_tutorials
from tests.docs.pages import Command, blocks, steps

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])
FOLLOWED = {
    *(ROOT / name for name in test_tutorials.PAGES),
    *(ROOT / name for pages in test_tutorials.CONTINUED.values() for name in pages),
    *test_how_to.PAGES,
    *(DOCS / name for name in test_ros1_page.PAGES),
    *(DOCS / name for name in ("adapt-a-robot.md", "assert.md", "cameras.md", "kitting.md", "operate.md")),
    *test_lesson.PAGES,
}
"""Pages whose `console` and `python` blocks a test runs."""
RUN = ("console", "python")
TO_RUN = (*RUN, "sh", "bash", "shell", "py", "cpp", "")
FOR_READING = ("yaml", "toml", "xml", "csv", "text", "cmake")

COMMANDS = typer.main.get_command(app)


def test_mark_applies_to_block_below_it_only(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- not run: it is long -->\n```sh\none\n```\n\n```console\n$ two\n```\n")
    assert [(each.language, each.why) for each in blocks(page)] == [("sh", "it is long"), ("console", None)]
    assert [step.line for step in steps(page) if isinstance(step, Command)] == ["two"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_block_of_page_is_run_or_gives_reason(page: Path) -> None:
    for block in blocks(page):
        assert block.language in (*TO_RUN, *FOR_READING), block.body
        is_run = page in FOLLOWED and block.language in RUN
        if block.key != "file" and block.language in TO_RUN and not is_run:
            assert block.why, f"run it, or say why not in <!-- not run: … -->:\n{block.body}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_path_in_reason_of_block_exists(page: Path) -> None:
    for block in blocks(page):
        for path in re.findall(r"\b(?:tests|docs)/[\w./-]*\w", block.why or ""):
            assert (ROOT / path).exists(), path


def given(page: Path) -> list[str]:
    """The commands of Cellwright's own that a page names: in blocks, and in running text."""
    found = []
    for block in blocks(page):
        if block.language in ("console", "sh", "bash"):
            lines = block.body.replace("\\\n", " ").splitlines()
            found += [line.removeprefix("$ ") for line in lines if re.match(r"(\$ )?cellwright ", line)]
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return [*found, *re.findall(r"`(cellwright [a-z][^`]*)`", text.replace("\n", " "))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_command_in_page_exists_with_its_options(page: Path) -> None:
    for line in given(page):
        words = shlex.split(re.split(r" # |[;|>&]", line)[0])
        check_command(COMMANDS, words[1:], line)


def check_command(command: Any, words: list[str], line: str) -> None:
    """That there is a command of this name, and that it has these options."""
    inner = getattr(command, "commands", None)
    if inner is not None and words and re.fullmatch("[a-z][a-z0-9-]*", words[0]):
        count = 2 if " ".join(words[:2]) in inner else 1
        assert " ".join(words[:count]) in inner, f"no such command: {line}"
        check_command(command.get_command(None, " ".join(words[:count])), words[count:], line)
        return
    if "--ros-args" in words:  # what follows is rclpy's
        words = words[: words.index("--ros-args")]
    options = {name for each in command.params for name in (*each.opts, *each.secondary_opts)}
    for word in words:
        name = word.strip("[](),").partition("=")[0]
        if re.fullmatch(r"--?[a-z][a-z0-9-]*", name):
            assert name in {*options, "--help"}, f"no such option {name}: {line}"


def test_check_of_unknown_command_or_option_fails() -> None:
    check_command(COMMANDS, ["run", "lesson", "--agent", "none"], "")
    check_command(COMMANDS, ["operate", "signal", "--wave", "step"], "")
    check_command(COMMANDS, ["eval", "merge", "a", "--out", "b"], "")
    with pytest.raises(AssertionError, match="no such option --agent"):
        check_command(COMMANDS, ["eval", "merge", "a", "--agent", "none"], "")
    with pytest.raises(AssertionError, match="no such command"):
        check_command(COMMANDS, ["rum", "lesson"], "")
    with pytest.raises(AssertionError, match="no such option --agnt"):
        check_command(COMMANDS, ["run", "lesson", "--agnt"], "")
