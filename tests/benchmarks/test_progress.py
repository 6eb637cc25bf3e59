"""Progress of a benchmark."""

import io

import pytest
from rich.console import Console

from benchmarks.report import telling


def test_plain_lines_where_nothing_can_move() -> None:
    file = io.StringIO()
    with telling(Console(file=file, width=20), "A [thing]") as on_progress:
        on_progress("with a line that is longer than the console")
        on_progress("well")
    assert file.getvalue().splitlines() == ["A [thing]: with a line that is longer than the console", "A [thing]: well"]


def test_a_terminal_gets_a_line_that_is_gone_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, force_interactive=True, width=80)
    with telling(console, "A thing") as on_progress:
        on_progress("half of it")
    assert "half of it" in file.getvalue()
    assert file.getvalue().endswith("\x1b[2K")
