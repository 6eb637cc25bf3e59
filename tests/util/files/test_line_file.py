"""File that grows line by line and keeps the written lines."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cellwright.util.files import LineFile
from tests.support.waiting import TIMEOUT

FULL = Path("/dev/full")


def test_several_lines_are_written_at_once(tmp_path: Path) -> None:
    file = LineFile(tmp_path / "a.log")
    file.write("one\ntwo")
    assert (tmp_path / "a.log").read_text() == "one\ntwo\n"
    file.close()
    file.write("behind the end")
    file.close()
    assert (tmp_path / "a.log").read_text() == "one\ntwo\n"


def test_append_ends_cut_line_first(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("whole\ncut sho")
    LineFile(path, append=True).write("next")
    assert path.read_text() == "whole\ncut sho\nnext\n"


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL here")
def test_written_lines_survive_killed_program(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    code = (
        "import os, signal, sys; from pathlib import Path; from cellwright.util.files import LineFile\n"
        "file = LineFile(Path(sys.argv[1]))\n"
        "for number in range(100): file.write(str(number))\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(path)], check=False, timeout=TIMEOUT, env=dict(os.environ))
    assert killed.returncode == -signal.SIGKILL
    assert path.read_text().split() == [str(number) for number in range(100)]


@pytest.mark.skipif(not FULL.exists(), reason="this system has no device that is always full")
def test_full_disk_is_reported_once() -> None:
    reported: list[str] = []
    file = LineFile(FULL, append=True, report=reported.append)
    file.write("one")
    file.write("two")
    assert not file.is_writing
    assert reported == ["/dev/full: cannot be written any more: No space left on device"]


def test_unopenable_file_raises_os_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="directory"):
        LineFile(tmp_path)
