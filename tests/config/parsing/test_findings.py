"""Findings about what a file describes."""

import pytest

from cellwright.config.parsing.findings import Finding
from cellwright.config.parsing.tree import Place

PLACES = {"cell": Place(0, "a.yaml", 2), "cell.bins.bin1": Place(1, "b.yaml", 7)}


@pytest.mark.parametrize(
    ("key", "place"),
    [
        ("cell.bins.bin1", "b.yaml:7: "),
        ("cell.bins.bin1.size", "b.yaml:7: "),
        ("cell.bins.bin10", "a.yaml:2: "),
        ("sensors.eye", ""),
    ],
)
def test_place_is_that_of_the_next_entry_around(key: str, place: str) -> None:
    assert str(Finding(key, "is wrong").at(PLACES, "error")) == f"{place}{key}: is wrong"


def test_severity_is_given() -> None:
    assert Finding("cell", "is odd").at(PLACES, "warning").severity == "warning"
