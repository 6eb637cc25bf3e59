"""Tests of the seeds of an evaluation: a number, or a file."""

from pathlib import Path

import pytest

from cellwright.running.evaluation.plan.seeds import MAX_SEEDS, read_seeds
from cellwright.util.errors import UsageError


def test_number_gives_the_seeds_from_one_on() -> None:
    assert list(read_seeds("4")) == [1, 2, 3, 4]


def test_file_gives_its_seeds_in_their_order_without_comments(tmp_path: Path) -> None:
    file = tmp_path / "seeds.txt"
    file.write_text("# of the test\n7\n\n3  # the hard one\n100200\n", encoding="utf-8")
    assert list(read_seeds(str(file))) == [7, 3, 100200]


@pytest.mark.parametrize("text", ["0", "-1", str(MAX_SEEDS + 1)])
def test_number_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=f"^{text}: give a number from 1 to {MAX_SEEDS}$"):
        read_seeds(text)


def test_text_that_is_no_number_and_no_file_is_refused() -> None:
    with pytest.raises(UsageError, match=r"^many: is no number of seeds and no file; give a number from 1, or a file"):
        read_seeds("many")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1\ntwo\n", r"seeds.txt:2: must be a whole number from 0 to \d+ \(got two\)"),
        ("1\n-2\n", r"seeds.txt:2: must be a whole number from 0 to \d+ \(got -2\)"),
        (f"{2**63}\n", r"seeds.txt:1: must be a whole number"),
        ("5\n6\n5\n", "seeds.txt:3: 5 is in line 1 too; leave one out"),
        ("# nothing\n", r"must have 1 to \d+ seeds, one a line \(got 0\)"),
    ],
)
def test_file_with_a_fault_is_refused_with_its_line(content: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "seeds.txt"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(UsageError, match=message):
        read_seeds(str(file))


def test_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "seeds.txt"
    file.write_bytes(b"\xff\xfe1")
    with pytest.raises(UsageError, match="cannot be read"):
        read_seeds(str(file))
