"""Lists of plain coordinates."""

import pytest

from cellwright.config.parsing.coordinates import coordinates
from tests.config.parsing.test_reader import table


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{at: 5}", "must be a list of three numbers (got the number 5)"),
        ("{at: [1]}", "must be a list of three numbers (got a list of 1)"),
        ("{at: [1, 2, pi]}", "must be a plain number (got the text 'pi'); this list has no expressions"),
        ("{at: [1, 2, .inf]}", "must be a finite number"),
        ("{at: [1, 2, 20000]}", "coordinates must be within ±10000 m (got 20000)"),
    ],
)
def test_list_that_is_no_place_is_refused(text: str, message: str) -> None:
    root, reader = table(text)
    assert coordinates(2)(reader, root.entries["at"].value) is None
    assert [problem.message for problem in reader.problems.errors] == [message]


def test_whole_numbers_stay_whole_and_further_ones_are_ignored() -> None:
    root, reader = table("{at: [1, 2.5, 3, 4]}")
    assert coordinates(3)(reader, root.entries["at"].value) == (1, 2.5, 3)
    assert [problem.message for problem in reader.problems.warnings] == [
        "must be a list of three numbers (got a list of 4); the others are ignored"
    ]
