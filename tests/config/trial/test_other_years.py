"""Errors for files of other years name the year."""

import pytest

from cellwright.config.parsing.tree import Scalar
from cellwright.config.trial.other_years import LATER_OPTIONS
from tests.config.trial.texts import error, errors, warning


def test_errors_name_year_of_other_formats() -> None:
    early = "orders: {order_0: {announcement_time: 30, parts: {}}, order_1: {announcement_time: 60, parts: {}}}"
    first, second = errors(early)
    assert "orders.order_0.announcement_time: this entry belongs to the 2016 format" in first
    assert "write announcement_condition: time and announcement_condition_value: 30 instead" in first
    assert second.endswith("announcement_condition_value: 60 instead")
    assert "belt parts are listed by type and then by time [s]" in error("belt_parts: {1.0: {type: part1, pose: {}}}")
    assert "must be a number (got the text 'xyz')" in error("belt_parts: {part1: {xyz: [0, 0, 0]}}")
    later = (
        "orders: {o: {announcement_condition: time, announcement_condition_value: 0, products: {}, destinations: []}}"
    )
    assert "'products' belongs to the 2019 format; Cellwright reads the 2017 format; did you mean parts" in error(later)


@pytest.mark.parametrize(("option", "year"), LATER_OPTIONS.items())
def test_option_of_a_later_year_is_ignored_with_its_year(option: Scalar, year: int) -> None:
    assert f"new in the {year} format" in warning(f"options: {{{option!s}: true}}")


@pytest.mark.parametrize(("section", "year"), [("belt_models", 2018), ("models_over_shelves", 2020), ("parts", 2023)])
def test_section_of_a_later_year_is_refused_with_its_year(section: str, year: int) -> None:
    assert f"it belongs to the {year} format" in error(f"{section}: {{}}")
