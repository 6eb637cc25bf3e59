"""Tests of lines on the console, and of the progress line."""

from __future__ import annotations

import io
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from cellwright.cli import output
from cellwright.cli.output import progress_bar
from cellwright.engine.loop import PaceFigures


class Served:
    address = ("127.0.0.1", 11399)
    lockstep = False
    busy_port = 0


def test_warning_goes_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    output.warn(ValueError("so it is"))
    assert capsys.readouterr() == ("", "warning: so it is\n")


def test_files_are_printed_one_per_line_with_brackets_kept() -> None:
    out = StringIO()
    output.print_files(Console(file=out, width=20), "picture", ["a.png", "[red]a long name of a picture.png"])
    assert out.getvalue() == "picture     a.png\npicture     [red]a long name of a picture.png\n"


@pytest.mark.parametrize(
    ("speed", "lockstep", "expected"),
    [
        (1.0, False, "real time"),
        (2.5, False, "2.5 x real time"),
        (None, False, "as fast as possible"),
        (None, True, "lockstep"),
    ],
)
def test_ready_line_shows_address_and_rate(speed: float | None, lockstep: bool, expected: str) -> None:
    served = Served()
    served.lockstep = lockstep
    assert output.ready_line("lesson", served, speed) == f"ready: lesson at 127.0.0.1:11399, {expected}"  # type: ignore[arg-type]


def test_ready_line_reports_default_port_in_use() -> None:
    served = Served()
    served.address, served.busy_port = ("127.0.0.1", 11400), 11399
    line = output.ready_line("lesson", served, 1.0)  # type: ignore[arg-type]
    assert line == "ready: lesson at 127.0.0.1:11400 (11399 is in use), real time"


def test_pace_text_has_units() -> None:
    stood = PaceFigures(0.5, 0.0123, 2.04)
    assert output.pace_text(stood).endswith(" ms late, 2.0 s paused for slow clients")
    assert output.pace_text(PaceFigures(0.99996, 0.0123)) == "1.0000 x real time, latest step 12.3 ms late"


def test_line_is_printed_without_markup() -> None:
    out = StringIO()
    output.print_line(Console(file=out, width=10), "[red] is no markup, and nothing is folded", "yellow")
    assert out.getvalue() == "[red] is no markup, and nothing is folded\n"


def test_unwritable_result_file_is_reported(tmp_path: Path) -> None:
    assert output.write_result(tmp_path / "a.txt", "done") == []
    assert (tmp_path / "a.txt").read_text() == "done"
    (problem,) = output.write_result(tmp_path / "none" / "a.txt", b"done")
    assert problem == f"{tmp_path / 'none' / 'a.txt'}: cannot be written: No such file or directory"


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
