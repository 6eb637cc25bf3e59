"""JSON Schema of the section `cell`."""

from typing import Any

import pytest
from jsonschema import Draft202012Validator

from cellwright.config.layout.schema import cell_schema

VALIDATOR = Draft202012Validator(cell_schema())


@pytest.mark.parametrize(
    ("cell", "valid"),
    [
        ({}, True),
        ({"bins": {"a": {"at": [1, "pi/2"]}}}, True),
        ({"bins": {"a": {"at": [1]}}}, False),
        ({"bins": {"a": {"sice": 1}}}, False),
        ({"bins": {"a": {}}}, False),
        ({"bins": {"a": None}}, False),
        ({"based_on": "empty", "bins": {"a": {}}}, False),
        ({"based_on": "gear2017", "bins": {"bin1": {"turn": 1}, "bin2": None, "bin3": {"turn": None}}}, True),
        ({"based_on": "gear2017", "bins": {"bin1": {"turn": 90}}}, False),
        ({"belts": {"b": {"from": [0, 0], "to": [1, 0]}}, "floor_lines": [{"at": [0, 0], "size": [1, 1]}]}, True),
        ({"floor_lines": [{"at": [0, 0]}]}, False),
        ({"bind": {}}, False),
    ],
)
def test_cell_is_judged_as_by_the_reader(cell: dict[str, Any], valid: bool) -> None:
    assert VALIDATOR.is_valid(cell) == valid
