from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cellwright.util.process import OUTPUT_LOST_STATUS, StandardStreams, TolerantStream
from tests.support.waiting import TIMEOUT

FULL = Path("/dev/full")
ON_POSIX = pytest.mark.skipif(sys.platform == "win32", reason="no such shell there")


class Disk(io.RawIOBase):
    """File that accepts a number of bytes, a few at a time, and then no more."""

    def __init__(self, size: int, number: int = errno.ENOSPC) -> None:
        self.content, self._size, self._number = b"", size, number

    def write(self, data: object, /) -> int:
        if len(self.content) >= self._size:
            raise OSError(self._number, os.strerror(self._number))
        piece = bytes(data[:7])  # type: ignore[index]
        self.content += piece
        return len(piece)

    def writable(self) -> bool:
        return True


def text_stream(disk: Disk, *, encoding: str = "utf-8", buffered: bool = True) -> io.TextIOWrapper:
    buffer: Any = io.BufferedWriter(disk) if buffered else disk
    return io.TextIOWrapper(buffer, encoding=encoding)


@pytest.mark.parametrize("buffered", [True, False])
def test_stdout_is_passed_on_completely(monkeypatch: pytest.MonkeyPatch, *, buffered: bool) -> None:
    disk = Disk(10**6)
    monkeypatch.setattr(sys, "stdout", text_stream(disk, buffered=buffered))
    monkeypatch.setattr(sys, "stderr", text_stream(Disk(100)))
    streams = StandardStreams()
    sys.stdout.write("1\u2500\n" * 5000)
    assert streams.status(0) == 0
    assert disk.content.decode() == "1\u2500\n" * 5000


def test_non_blocking_pipe_is_waited_for() -> None:
    class Sometimes(Disk):
        turn = 0

        def write(self, data: object, /) -> int:
            self.turn += 1
            return super().write(data) if self.turn % 3 else None  # type: ignore[return-value]

    disk = Sometimes(100)
    outlet = TolerantStream(disk)
    assert outlet.write(b"x" * 30) == 30
    assert (disk.content, outlet.failure) == (b"x" * 30, None)


def test_characters_outside_encoding_are_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk(100)
    monkeypatch.setattr(sys, "stdout", text_stream(disk, encoding="latin-1"))
    streams = StandardStreams()
    sys.stdout.write("\xe9 \u2500 \udcff")
    assert streams.status(0) == 0
    assert disk.content == b"\xe9 \\u2500 \\udcff"


@pytest.mark.parametrize(
    ("number", "status", "message"),
    [
        (errno.ENOSPC, OUTPUT_LOST_STATUS, "error: stdout: cannot be written: No space left on device\n"),
        (errno.EPIPE, 0, ""),
    ],
)
def test_failing_stdout_does_not_end_command(
    number: int, status: int, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk, errors = Disk(14, number), Disk(1000)
    monkeypatch.setattr(sys, "stdout", text_stream(disk))
    monkeypatch.setattr(sys, "stderr", text_stream(errors))
    streams = StandardStreams()
    for _ in range(1000):
        sys.stdout.write("a line\n")
        sys.stdout.flush()
    assert streams.status(0) == status
    assert streams.status(2) == 2
    assert disk.content == b"a line\n" * 2
    assert errors.content.decode().startswith(message)


def test_failing_stderr_does_not_end_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", text_stream(Disk(0)))
    StandardStreams()
    sys.stderr.write("a line\n")
    sys.stderr.flush()


def test_replaced_stream_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    mine = io.StringIO()
    monkeypatch.setattr(sys, "stdout", mine)
    assert StandardStreams().status(0) == 0
    assert sys.stdout is mine


def test_tolerant_stream_reports_attributes_of_its_file(tmp_path: Path) -> None:
    with (tmp_path / "a").open("wb", buffering=0) as raw:
        outlet = TolerantStream(raw)
        assert (outlet.fileno(), outlet.isatty(), outlet.name) == (raw.fileno(), False, raw.name)


@pytest.mark.slow
@ON_POSIX
@pytest.mark.skipif(not FULL.exists(), reason="no disk that is always full")
def test_command_with_full_stdout_exits_with_1() -> None:
    with FULL.open("w") as full:
        ran = subprocess.run(
            [sys.executable, "-m", "cellwright", "trials"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (ran.returncode, ran.stderr) == (1, "error: stdout: cannot be written: No space left on device\n")


@pytest.mark.slow
@ON_POSIX
def test_command_with_closed_streams_exits_with_0() -> None:
    ran = subprocess.run(
        ["sh", "-c", 'exec "$0" -m cellwright trials <&- >&- 2>&-', sys.executable], check=False, timeout=TIMEOUT
    )
    assert ran.returncode == 0
