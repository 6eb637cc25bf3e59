"""JSON Schema of single readers and of tables of keys."""

import pytest
from jsonschema import Draft202012Validator

from cellwright.config.parsing.reader import Keys, Read, Reader, any_name, choice, number, numbers, one_of, whole
from cellwright.config.parsing.schema import Elsewhere, array, mapping, schema_of


@pytest.mark.parametrize(
    ("read", "accepted", "refused"),
    [
        (Reader.number, (1, 2.5, "3e2", " -.5 "), ("pi", True, None, [])),
        (Reader.not_negative, (0, 1.5), (-1,)),
        (Reader.boolean, (True, False), (0, "yes")),
        (Reader.whole, (0, 7), (-1, 1.5, "1", True)),
        (Reader.name, ("bin1", 5), (None, [], True)),
        (Reader.vector, ([0, "pi/2", 1.5],), ([0, 1], [0, 1, 2, 3], "pi", [None, 0, 0])),
        (Reader.pose, ({}, {"xyz": [0, 0, 1]}, {"rpy": [0, 0, "pi"], "more": 1}), (None, {"xyz": 1})),
        (one_of(("red", "white")), ("red",), ("blue", 1)),
        (choice(("lower", "upper")), ("lower",), ("low",)),
        (any_name(("red",)), ("red", "blue", 1), (None, [])),
        (number(0.0, 1.0), (0, 1, 0.5, "0.5"), (1.5, -0.1, "word")),
        (whole(1, 3), (1, 3), (0, 4, 1.5)),
        (numbers(2, "x, y"), ([1, "2"],), ([1], [1, 2, 3], [1, "x"])),
    ],
)
def test_schema_accepts_what_the_reader_accepts(
    read: Read, accepted: tuple[object, ...], refused: tuple[object, ...]
) -> None:
    validator = Draft202012Validator(schema_of(read))
    assert [value for value in accepted if not validator.is_valid(value)] == []
    assert [value for value in refused if validator.is_valid(value)] == []


def test_reader_without_schema_accepts_anything() -> None:
    assert schema_of(None) == schema_of(lambda reader, node: None) == {}


def test_only_strict_keys_refuse_other_entries() -> None:
    loose, strict = Keys({"power": Reader.number}), Keys({"power": Reader.number}, strict="property")
    data = {"power": 1, "colour": "red"}
    assert Draft202012Validator(loose.schema()).is_valid(data)
    assert not Draft202012Validator(strict.schema()).is_valid(data)
    assert not Draft202012Validator(loose.schema()).is_valid({"colour": "red"})


def test_entry_that_is_read_elsewhere_has_its_schema() -> None:
    keys = Keys(optional={"lamps": Elsewhere(lambda: mapping(array({"type": "number"}, 1, 2)))})
    validator = Draft202012Validator(keys.schema())
    assert validator.is_valid({"lamps": {"one": [1, 2]}})
    assert not validator.is_valid({"lamps": {"one": []}})
