"""Progress of a benchmark."""

import io

import pytest
from rich.console import Console

from benchmarks.report import progress_line


def test_progress_without_terminal_prints_plain_lines() -> None:
    file = io.StringIO()
    with progress_line(Console(file=file, width=20), "A [thing]") as on_progress:
        on_progress("with a line that is longer than the console")
        on_progress("well")
    assert file.getvalue().splitlines() == ["A [thing]: with a line that is longer than the console", "A [thing]: well"]


def test_progress_line_in_terminal_is_erased_at_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, force_interactive=True, width=80)
    with progress_line(console, "A thing") as on_progress:
        on_progress("half of it")
    assert "half of it" in file.getvalue()
    assert file.getvalue().endswith("\x1b[2K")
