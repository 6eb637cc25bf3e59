"""Sections read by their keys: what is missing, unknown or refused is reported, and the rest arrives by name."""

from dataclasses import dataclass

import pytest

from cellwright.config.parsing.reader import Keys, Reader, choice, number, numbers, one_of, section, whole
from cellwright.config.parsing.sources import JoinedText, Text
from cellwright.config.parsing.tree import Problems, Table
from cellwright.config.parsing.yaml_source import parse


@dataclass(frozen=True)
class Lamp:
    power: float
    color: str = "white"
    is_on: bool = False


KEYS = Keys(
    {"power": number(0.0, 100.0, "W")},
    {"color": one_of(("white", "red"), "colour"), "is_on": Reader.boolean, "note": None},
    "property",
)


def table(text: str) -> tuple[Table, Reader]:
    problems = Problems()
    root = parse(JoinedText([Text("lamp.yaml", text)]), problems)
    assert isinstance(root, Table)
    return root, Reader(problems)


def test_table_values_are_returned_by_name() -> None:
    root, reader = table("{power: 5, color: red, note: old}")
    values = KEYS.read(root, reader)
    assert (values, reader.problems.errors) == ({"power": 5.0, "color": "red"}, ())
    assert KEYS.complete(values)
    assert Lamp(**values) == Lamp(5.0, "red")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "the required entry 'power' is missing"),
        ("{power: 200}", "power: must be from 0 to 100 W (got 200)"),
        ("{power: 1, color: rad}", "color: unknown colour 'rad'; did you mean red"),
        ("{power: 1, color: [red]}", "color: must be a name (got a list)"),
        ("{power: 1, is_on: 1}", "is_on: must be true or false (got the number 1)"),
        ("{power: 1, colour: red}", "colour: unknown property; did you mean color"),
        ("{power: 1, x: red}", "x: unknown property (known: power, color, is_on, note)"),
    ],
)
def test_invalid_entry_gives_one_error(text: str, message: str) -> None:
    root, reader = table(text)
    values = KEYS.read(root, reader)
    (problem,) = reader.problems.errors
    assert str(problem).endswith(message)
    assert KEYS.complete(values) == ("power: 1" in text)


def test_unknown_entry_of_lenient_keys_is_warning() -> None:
    root, reader = table("{a: 1, b: 2, c: 3}")
    assert Keys(optional={"a": Reader.whole}).read(root, reader, ("b",)) == {"a": 1}
    assert [str(each) for each in reader.problems.warnings] == ["lamp.yaml:1: c: unknown entry, ignored"]


def test_section_is_made_only_if_complete() -> None:
    root, reader = table("{a: {power: 1}, b: {}, c: 3}")
    made = [section(KEYS, Lamp)(reader, entry.value) for entry in root.entries.values()]
    assert made == [Lamp(1.0), None, None]


def test_numbers_choice_and_whole_readers_accept_or_refuse() -> None:
    root, reader = table("{a: [1, 2], b: [1], c: up, d: 3, e: 300, f: [1, x]}")
    pair, direction, count = numbers(2, "x, y"), choice(("up", "down")), whole(1, 9, "bits")
    readers = {"a": pair, "b": pair, "c": direction, "d": count, "e": count, "f": pair}
    found = [read(reader, root.entries[name].value) for name, read in readers.items()]
    assert found == [(1.0, 2.0), None, "up", 3, None, None]
    assert [problem.message for problem in reader.problems.errors] == [
        "must be a list of 2 numbers, x, y (got a list of 1)",
        "must be from 1 to 9 bits (got 300)",
        "must be a number (got the text 'x')",
    ]
    assert direction(reader, root.entries["d"].value) is None
    assert reader.problems.errors[-1].message == "must be up or down (got the number 3)"
