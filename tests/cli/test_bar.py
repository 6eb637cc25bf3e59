"""Tests of the progress line: on a terminal, and nowhere else."""

import io

import pytest
from rich.console import Console

from cellwright.cli.output import progress_bar


def text(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_progress_bar_without_terminal_is_not_shown() -> None:
    console = Console(file=io.StringIO())
    with progress_bar(console, "drawing", 1.0) as tell:
        assert tell is None
    assert text(console) == ""


def test_progress_bar_on_terminal_shows_progress_and_disappears(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    console = Console(file=io.StringIO(), force_terminal=True, force_interactive=True, width=80)
    with progress_bar(console, "drawing", 1.0) as tell:
        assert tell is not None
        tell(0.5, "half of it")
    assert "drawing" in text(console)
    assert "half of it" in text(console)
    assert text(console).endswith("\x1b[2K")
