"""Tests of the comparison of a run with its commands alone; the runs themselves are in the tests of protection."""

import pytest

from cellwright.running.evaluation.execution.channel import Report
from cellwright.running.evaluation.execution.replayed import first_difference


def report(**changes: object) -> Report:
    known = {
        "outcome": "done",
        "points": 4.0,
        "wall": 1.0,
        "simulated": 20.0,
        "state_hash": "a" * 64,
        "error": "",
        "steps": 10,
        "success": None,
    }
    return Report(**{"score": {"orders": [1]}, "timeline": {}, **known, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("reported", "played", "difference"),
    [
        ({}, {"wall": 9.0}, ""),
        ({"points": 4.0 + 1e-7}, {}, ""),
        ({"points": 6.0}, {}, "its commands alone earn 4 points, but 6 were reported"),
        ({"outcome": "crashed"}, {"outcome": "until"}, ""),
        ({}, {"outcome": "time_limit"}, "its commands alone end as time_limit, but done was reported"),
        ({"score": {"orders": [2]}}, {}, "its commands alone give other kits than were reported"),
        (
            {"success": True},
            {"success": False},
            "its commands alone do not succeed in the task, other than was reported",
        ),
        ({"state_hash": "b" * 64}, {}, "its commands alone lead to another state of the cell"),
    ],
)
def test_first_difference_is_said(reported: dict[str, object], played: dict[str, object], difference: str) -> None:
    assert first_difference(report(**reported), report(**played)) == difference
