"""Rows of a table: placeholders, rates in words, and where a row exists."""

from fractions import Fraction
from types import SimpleNamespace

import pytest

from cellwright.middleware.interface.table import ALWAYS, EndpointKind, Timing, Where, accepts, publishes

DOORS = Where("for each door", lambda house: house.doors)
GARDEN = Where.when("with a garden", lambda house: house.garden)


def test_row_exists_where_predicate_of_description_says() -> None:
    house = SimpleNamespace(doors=("a", "b"), garden=False)
    row = publishes("/{sensor}/state", "std_msgs/Bool", 5, DOORS, "Open.")
    assert [row.of(door).name for door in row.where.subjects(house)] == ["/a/state", "/b/state"]
    assert not GARDEN.subjects(house)
    assert GARDEN.subjects(SimpleNamespace(garden=True)) == ALWAYS.subjects(house) == (None,)


def test_row_without_subject_is_itself() -> None:
    row = accepts(EndpointKind.SERVICE, "/ask", "std_srvs/Trigger", ALWAYS, "Asks.")
    assert row.of(None) is row
    assert (row.rate, row.period, row.rate_text) == (None, None, "")


@pytest.mark.parametrize(
    ("rate", "text", "period"),
    [(50, "50 Hz", Fraction(1, 50)), (Timing.EACH_STEP, "each step", None), (Timing.ON_EVENT, "on event", None)],
)
def test_rate_has_words_and_period(rate: int | Timing, text: str, period: Fraction | None) -> None:
    row = publishes("/x", "std_msgs/Bool", rate, ALWAYS, "X.")
    assert (row.rate_text, row.period) == (text, period)
