"""JSON lines on disk: whole or not at all, and a full disk is reported once."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.util.errors import UsageError
from cellwright.util.files import JsonLines, read_json_lines

FULL = Path("/dev/full")


def test_each_line_is_written_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    with JsonLines(path) as lines:
        for number in range(3):
            lines.write_value({"n": number, "text": "ä\nb"})
            assert read_json_lines(path) == [{"n": n, "text": "ä\nb"} for n in range(number + 1)]
    assert not lines.is_writing
    lines.write_value({"n": 9})  # closed: nothing is written
    assert len(read_json_lines(path)) == 3


def test_file_is_replaced_or_appended_to(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    for append, expected in ((False, [1]), (True, [1, 2]), (False, [3])):
        with JsonLines(path, append=append) as lines:
            lines.write_value({"n": expected[-1]})
        assert [value["n"] for value in read_json_lines(path)] == expected


@pytest.mark.parametrize("cut", ['{"n": 1', "[1]", "", "\n", "\x00\x00", "12"])
def test_cut_line_is_left_out_and_next_one_is_whole(cut: str, tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text('{"n": 0}\n' + cut)
    assert read_json_lines(path) == [{"n": 0}]
    with JsonLines(path, append=True) as lines:
        lines.write_value({"n": 2})
    assert read_json_lines(path) == [{"n": 0}, {"n": 2}]


@given(size=st.integers(0, 200))
def test_file_cut_anywhere_keeps_whole_lines(size: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    cut = b"".join(b'{"n": %d}\n' % n for n in range(20))[:size]
    path = tmp_path_factory.getbasetemp() / "cut.jsonl"
    path.write_bytes(cut)
    whole = cut.count(b"\n") + cut.endswith(b"}")
    assert [value["n"] for value in read_json_lines(path)] == list(range(whole))


@pytest.mark.skipif(not FULL.exists(), reason="this system has no device that is always full")
def test_full_disk_is_reported_once() -> None:
    reported: list[str] = []
    with JsonLines(FULL, append=True, report=reported.append) as lines:
        lines.write_value({"n": 1})
        assert not lines.is_writing
        lines.write_value({"n": 2})
    assert reported == ["/dev/full: cannot be written any more: No space left on device"]


def test_unopenable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be written"):
        JsonLines(tmp_path)
    with pytest.raises(UsageError, match="cannot be read"):
        read_json_lines(tmp_path / "none.jsonl")


def test_nan_is_refused(tmp_path: Path) -> None:
    with JsonLines(tmp_path / "a.jsonl") as lines, pytest.raises(ValueError, match="not JSON compliant"):
        lines.write_value({"x": float("nan")})
