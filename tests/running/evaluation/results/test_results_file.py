"""Tests of results on disk."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.results.folder import RESULTS_NAME
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.running.evaluation.results.results_file import ResultsFile, read_results
from cellwright.running.evaluation.results.seal import KEY_VARIABLE
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked


def write(folder: Path) -> bytes:
    with ResultsFile(folder) as store:
        for each in (worked(), CRASHED, LOST):
            store.append(each)
        return store.path.read_bytes()


def test_appended_results_are_on_disk_and_read_back(tmp_path: Path) -> None:
    lines = write(tmp_path / "new" / "folder").splitlines()
    assert [json.loads(line)["outcome"] for line in lines] == ["done", "crashed", "wall_limit"]
    with ResultsFile(tmp_path / "new" / "folder") as store:
        assert list(store.results.values()) == [worked(), CRASHED, LOST]


def test_later_result_of_same_key_counts(tmp_path: Path) -> None:
    write(tmp_path)
    with ResultsFile(tmp_path) as store:
        store.append(replace(LOST, points=1.0))
        assert store.results[LOST.key].points == 1.0
    with ResultsFile(tmp_path) as store:
        assert store.results[LOST.key].points == 1.0
        assert len(store.results) == 3


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such links and devices")
@pytest.mark.parametrize("device", ["/dev/full", "/dev/zero", "."])
def test_file_that_is_not_regular_is_refused(tmp_path: Path, device: str) -> None:
    (tmp_path / RESULTS_NAME).symlink_to(device)
    with pytest.raises(UsageError, match=r"results\.jsonl: it is a link, not a regular file"):
        ResultsFile(tmp_path)


@pytest.mark.slow
@given(cut=st.integers(min_value=0, max_value=10_000))
def test_truncated_file_keeps_whole_lines_and_takes_new_ones(
    cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    whole = write(folder)
    cut %= len(whole) + 1
    file = folder / "results.jsonl"
    file.write_bytes(whole[:cut])
    complete = whole[:cut].count(b"\n")
    with ResultsFile(folder) as store:
        assert list(store.results.values()) == [worked(), CRASHED, LOST][:complete]
        store.append(result(seed=9))
    with ResultsFile(folder) as store:
        assert len(store.results) == complete + 1
        assert store.results[result(seed=9).key] == result(seed=9)


BROKEN = ["no json", "[]", "{}", '{"key": "a"}', "", '{"refused": 5}', "[" * 100_000, '"\\ud800"', "1" * 5000, "\x00"]
"""Lines that are no result."""


@pytest.mark.parametrize("line", BROKEN)
def test_damaged_line_costs_no_other_and_is_said_once(line: str, tmp_path: Path) -> None:
    first = write(tmp_path)
    file = tmp_path / "results.jsonl"
    damaged = first + line.encode() + b"\n" + first
    file.write_bytes(damaged)
    with ResultsFile(tmp_path) as store:
        assert list(store.results.values()) == [worked(), CRASHED, LOST]
        (notice,) = store.notices
        store.append(result(seed=9))
    assert notice.startswith(f"{file}:4: ")
    assert notice.endswith("; this line is not believed")
    assert notice.isprintable()
    assert file.read_bytes().startswith(damaged)
    notices: list[str] = []
    assert len(read_results(tmp_path, notices)) == 4
    assert notices == [notice]


@pytest.mark.parametrize("number", [0, 1, 2])
def test_edited_result_is_not_believed_until_its_run_is_done_again(number: int, tmp_path: Path) -> None:
    lines = write(tmp_path).splitlines(keepends=True)
    before = [worked(), CRASHED, LOST]
    points = f'"points":{before[number].points}'.encode()
    assert points in lines[number]
    lines[number] = lines[number].replace(points, b'"points":12.0')
    (tmp_path / "results.jsonl").write_bytes(b"".join(lines))
    with ResultsFile(tmp_path) as store:
        assert list(store.results.values()) == before[:number] + before[number + 1 :]
        assert store.notices == [
            f"{store.path}:{number + 1}: it was changed after it was written; this line is not believed"
        ]
        store.append(before[number])
    with ResultsFile(tmp_path) as store:
        assert store.results[before[number].key] == before[number]
        assert store.notices == []


def test_older_result_does_not_take_the_place_of_an_edited_one(tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.append(result(12.0), result(3.0))
    store.path.write_bytes(store.path.read_bytes().replace(b'"points":3.0', b'"points":4.0'))
    with ResultsFile(tmp_path) as store:
        assert store.results == {}


def test_result_sealed_without_the_key_is_not_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path)
    monkeypatch.setenv(KEY_VARIABLE, "a secret")
    with ResultsFile(tmp_path) as store:
        assert store.results == {}
        assert len(store.notices) == 3
        assert KEY_VARIABLE in store.notices[0]
        store.append(worked())
    assert list(read_results(tmp_path).values()) == [worked()]
    monkeypatch.setenv(KEY_VARIABLE, "another")
    assert read_results(tmp_path) == {}


@given(position=st.integers(min_value=0), value=st.integers(min_value=0, max_value=255))
def test_line_with_any_other_byte_is_refused(position: int, value: int) -> None:
    line = bytearray(CRASHED.line)
    position %= len(line)
    if line[position] != value:
        line[position] = value
        with pytest.raises(ResultError):
            Result.from_line(bytes(line))


def edited(store: ResultsFile) -> None:
    store.path.write_bytes(result(12.0, seed=2).line + b"\n")


def appended(store: ResultsFile) -> None:
    with store.path.open("ab") as file:
        file.write(result(12.0, seed=2).line + b"\n")


def emptied(store: ResultsFile) -> None:
    store.path.write_bytes(b"")


def spoiled(store: ResultsFile) -> None:
    store.path.write_bytes(b"no result\n")


@pytest.mark.parametrize("change", [edited, appended, emptied, spoiled])
def test_file_changed_during_evaluation_is_written_again(change: Callable[[ResultsFile], None], tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.append(worked(), CRASHED)
        change(store)
        os.utime(store.path, (0, 0))
        store.append(LOST)
        change(store)
        store.restore()
        assert store.notices == [f"{store.path}: changed by another program meanwhile; written again"] * 2
    assert list(read_results(tmp_path).values()) == [worked(), CRASHED, LOST]


def test_touched_file_is_no_changed_one(tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.append(worked())
        store.path.chmod(0o600)
        store.append(LOST)
        assert store.notices == []


@pytest.mark.skipif(sys.platform == "win32", reason="what is open cannot be replaced there")
def test_replaced_file_ends_the_evaluation(tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.append(worked())
        os.link(store.path, tmp_path / "hidden")
        (tmp_path / "new").write_bytes(result(12.0).line + b"\n")
        (tmp_path / "new").replace(store.path)
        with pytest.raises(FileNotFoundError, match="removed or replaced"):
            store.append(LOST)


@pytest.mark.parametrize("content", ["no json\n", "[]\n", "{}\n", "\n", "a,b\n1,2\n"])
def test_file_of_something_else_is_refused_and_unchanged(content: str, tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    file.write_text(content)
    with pytest.raises(UsageError, match=r"results\.jsonl:1: .*remove the file to start over"):
        ResultsFile(tmp_path)
    assert file.read_text() == content


def test_folder_in_use_is_refused(tmp_path: Path) -> None:
    with ResultsFile(tmp_path), pytest.raises(UsageError, match="in use by another evaluation"):
        ResultsFile(tmp_path)
    ResultsFile(tmp_path).close()


def test_folder_that_cannot_be_created_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="exists"):
        ResultsFile(tmp_path / "file")


@pytest.mark.parametrize("line", ["[" * 100_000, '{"a": NaN}', "1" * 5000, '"\\ud800"', "\x00"])
def test_invalid_lines_are_refused_in_one_line(tmp_path: Path, line: str) -> None:
    (tmp_path / RESULTS_NAME).write_text(f"{line}\n")
    with pytest.raises(UsageError, match=r"results\.jsonl:1: ") as raised:
        ResultsFile(tmp_path)
    assert str(raised.value).isprintable()


class FullDisk:
    """A file on a disk that is full after a number of bytes."""

    def __init__(self, file: Any, room: int) -> None:
        self._file, self._room = file, room

    def write(self, data: memoryview) -> int:
        if not self._room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count: int = self._file.write(data[: self._room])
        self._room -= count
        return count

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


@pytest.mark.parametrize("room", [0, 10])
def test_full_disk_keeps_earlier_results_without_partial_line(room: int, tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.append(worked())
        before = store.path.read_bytes()
        store._file = FullDisk(store._file, room)  # type: ignore[assignment]
        with pytest.raises(OSError, match="No space left"):
            store.append(CRASHED)
        assert store.results[CRASHED.key] == CRASHED
        assert store.path.read_bytes() == before
    with ResultsFile(tmp_path) as store:  # the disk has space again
        store.append(LOST)
        assert list(store.results.values()) == [worked(), LOST]


@pytest.mark.skipif(sys.platform == "win32", reason="what is open cannot be removed there")
def test_removed_file_is_reported_at_append(tmp_path: Path) -> None:
    with ResultsFile(tmp_path) as store:
        store.path.unlink()
        with pytest.raises(FileNotFoundError):
            store.append(worked())


def test_carriage_return_in_line_does_not_split_it(tmp_path: Path) -> None:
    file = tmp_path / RESULTS_NAME
    file.write_bytes(b"a\rb\n")
    with pytest.raises(UsageError, match=":1:"):
        ResultsFile(tmp_path)
    assert file.read_bytes() == b"a\rb\n"
