from __future__ import annotations

import errno
import os
import stat
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.trial.gear2017 import load_trial
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.opened import open_recording
from cellwright.util.errors import DescriptionError, RecordingError, UsageError
from cellwright.util.files import (
    JsonLines,
    LineFile,
    atomic_file,
    open_below,
    open_to_read,
    replacement_path,
    write_atomic,
)


class DiskFullError(Exception):
    """Stands for any error that ends a program half-way."""


@given(st.text() | st.binary(), st.binary())
def test_atomic_file_has_written_content(content: str | bytes, before: bytes) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "a"
        file.write_bytes(before)
        try:
            expected = content.encode() if isinstance(content, str) else content
        except UnicodeEncodeError:
            expected = before
            with pytest.raises(UnicodeEncodeError):
                write_atomic(file, content)
        else:
            write_atomic(file, content)
        assert file.read_bytes() == expected
        assert [each.name for each in Path(folder).iterdir()] == ["a"]


@pytest.mark.parametrize("is_there", [False, True])
def test_failed_write_leaves_folder_unchanged(tmp_path: Path, *, is_there: bool) -> None:
    file = tmp_path / "a"
    if is_there:
        file.write_text("before")

    def write_half() -> None:
        with atomic_file(file) as stream:
            stream.write(b"half")
            raise DiskFullError

    with pytest.raises(DiskFullError):
        write_half()
    assert [each.read_text() for each in tmp_path.iterdir()] == (["before"] if is_there else [])


def test_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught:
        write_atomic(tmp_path / "none" / "a.png", b"")
    assert caught.value.filename == str(tmp_path / "none" / "a.png")


def test_too_long_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="name too long") as caught:
        write_atomic(tmp_path / ("a" * 300), b"")
    assert caught.value.errno == errno.ENAMETOOLONG
    assert list(tmp_path.iterdir()) == []


def test_longest_name_is_written(tmp_path: Path) -> None:
    write_atomic(tmp_path / ("a" * 255), b"x")
    assert [each.read_bytes() for each in tmp_path.iterdir()] == [b"x"]


def test_folder_in_place_of_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        write_atomic(tmp_path, b"")


@pytest.mark.skipif(sys.platform == "win32", reason="no such files there")
class TestOnPosix:
    def test_device_is_written_and_not_replaced(self) -> None:
        write_atomic(Path("/dev/null"), b"x")
        assert stat.S_ISCHR(os.stat("/dev/null").st_mode)

    def test_link_stays_and_its_target_is_written(self, tmp_path: Path) -> None:
        (tmp_path / "link").symlink_to(tmp_path / "real")
        write_atomic(tmp_path / "link", b"1")
        write_atomic(tmp_path / "link", b"2")
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "real").read_bytes() == b"2"

    def test_permissions_stay(self, tmp_path: Path) -> None:
        file = tmp_path / "a"
        file.touch()
        file.chmod(0o640)
        write_atomic(file, b"x")
        assert stat.S_IMODE(file.stat().st_mode) == 0o640

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
    def test_full_disk_is_reported(self) -> None:
        with pytest.raises(OSError, match="No space left"):
            write_atomic(Path("/dev/full"), b"x")

    def test_read_only_file_is_not_replaced(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        file = tmp_path / "a"
        file.write_text("kept")
        openers = Path.open

        def open_or_not(path: Path, mode: str = "r", *more: object, **others: object) -> object:
            if path == file and mode != "r":  # as with a file and a folder without write permission
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return openers(path, mode, *more, **others)  # type: ignore[call-overload]

        monkeypatch.setattr(Path, "open", open_or_not)
        with pytest.raises(PermissionError):
            write_atomic(file, b"new")
        assert [each.read_text() for each in tmp_path.iterdir()] == ["kept"]

    def test_file_in_read_only_folder_is_written_directly(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        file = tmp_path / "a"
        file.write_text("a long text")
        openers = Path.open

        def open_or_not(path: Path, mode: str = "r", *more: object, **others: object) -> object:
            if mode == "xb":
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return openers(path, mode, *more, **others)  # type: ignore[call-overload]

        monkeypatch.setattr(Path, "open", open_or_not)
        write_atomic(file, b"short")
        assert file.read_bytes() == b"short"
        with pytest.raises(PermissionError) as caught:
            write_atomic(tmp_path / "b", b"x")
        assert caught.value.filename == str(tmp_path / "b")


def test_replacement_path_replaces_file_of_another_writer(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    with replacement_path(file) as unfinished:
        unfinished.write_text("new")
        assert not file.exists()

    def write_half() -> None:
        with replacement_path(file) as unfinished:
            unfinished.write_text("half")
            raise DiskFullError

    with pytest.raises(DiskFullError):
        write_half()
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("a.bag", "new")]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_named_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="it is a named pipe, not a file"):
        open_to_read(pipe)
    with pytest.raises(DescriptionError, match="pipe: cannot be read: it is a named pipe, not a file"):
        load_trial([pipe])
    with pytest.raises(RecordingError, match="it is a named pipe, not a file"):
        open_recording(pipe)


@pytest.mark.skipif(not os.path.isdir("/dev/fd"), reason="pipes without a name have no path")
def test_unnamed_pipe_of_shell_is_read() -> None:
    read, write = os.pipe()
    os.write(write, b"time_limit: 7\n")
    os.close(write)
    with open_to_read(Path(f"/dev/fd/{read}")) as file:
        assert file.read() == b"time_limit: 7\n"
    os.close(read)


def test_open_to_read_of_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        open_to_read(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_named_pipe_without_reader_is_refused_without_waiting_by_all_writers(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="it is a named pipe that no program reads"):
        write_atomic(pipe, "text")
    for writer in (LineFile, JsonLines, McapFile):
        with pytest.raises((OSError, UsageError), match="it is a named pipe that no program reads"):
            writer(pipe)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_named_pipe_with_reader_is_written(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_atomic(pipe, "text")
    assert os.read(reader, 100) == b"text"
    os.close(reader)


def test_plain_file_below_a_folder_is_read_and_its_links_are_refused(tmp_path: Path) -> None:
    folder, foreign = tmp_path / "results", tmp_path / "foreign"
    (folder / "logs").mkdir(parents=True)
    foreign.mkdir()
    (foreign / "a.log").write_text("secret")
    (folder / "logs" / "own.log").write_text("own")
    (folder / "logs" / "a.log").symlink_to(foreign / "a.log")
    (folder / "states").symlink_to(foreign)
    with open_below(folder, "logs/own.log") as file:
        assert file.read() == b"own"
    for name in ("logs/a.log", "states/a.log"):
        with pytest.raises(OSError, match="it is a link, not a regular file"):
            open_below(folder, name)
    with pytest.raises(OSError, match="not a regular file"):
        open_below(tmp_path, "results/logs")


def test_folder_that_is_a_link_of_the_user_is_read(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "plan.json").write_text("plan")
    (tmp_path / "link").symlink_to(tmp_path / "results")
    with open_below(tmp_path / "link", "plan.json") as file:
        assert file.read() == b"plan"
