"""The JSON Schema of a trial agrees with the loader."""

import re
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from cellwright.config.parsing.schema import DRAFT
from cellwright.config.trial import gear2017
from cellwright.config.trial.catalogue import all_bundled, find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.schema import SECTIONS, trial_schema
from cellwright.util.errors import DescriptionError
from tests.config.trial.whole import WHOLE

ROOT = Path(__file__).parents[3]
SCHEMA = trial_schema()
VALIDATOR = Draft202012Validator(SCHEMA)
NO_TRIALS = {"evaluation", "map.yaml"}
EXAMPLES = sorted(path for path in (ROOT / "examples").rglob("*.yaml") if NO_TRIALS.isdisjoint(path.parts))

WRONG: tuple[Any, ...] = (None, True, "word", 5, -5, 2.5, [], {}, [1], [1, 2, 3], ["a", "b", "c"], {"a": 1})
"""Values, each of which is of a wrong kind in most places."""
BY_KIND = re.compile(r"must be|must not be negative|is missing|unknown (?!part type|reference)|needs")
"""Refusals for the kind or the bounds of a value, not for what it refers to."""


def as_json(value: Any) -> Any:
    """Return data of YAML 1.1 as editors have it: keys are texts, and `on` is no truth value."""
    if isinstance(value, dict):
        return {"on" if key is True else str(key): as_json(each) for key, each in value.items()}
    return [as_json(each) for each in value] if isinstance(value, list) else value


def is_valid(data: Any) -> bool:
    return bool(VALIDATOR.is_valid(as_json(data)))


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of each value below the root."""
    found = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in found:
        yield (*path, key)
        yield from places(value, (*path, key))


def is_read_as_another_kind(path: tuple[Any, ...], value: Any) -> bool:
    """Return whether the loader reads a value in silence that the schema refuses: true as 1, nothing as no parts."""
    is_item = isinstance(path[-1], int) or path[-1] == "elbow_joint"
    return (value is True and is_item) or (value is None and path[-1] == "models")


def is_key_of_schema(path: tuple[Any, ...]) -> bool:
    """Return whether the schema lists the keys beside this one: a task's start names joints of the trial's arms."""
    return isinstance(path[-1], str) and path[:-1] != ("task", "start", "joints")


def replaced(path: tuple[Any, ...], value: Any) -> Any:
    data = deepcopy(WHOLE)
    body = data
    for step in path[:-1]:
        body = body[step]
    body[path[-1]] = value
    return data


def test_schema_is_of_its_draft() -> None:
    assert SCHEMA["$schema"] == DRAFT
    Draft202012Validator.check_schema(SCHEMA)


def test_each_section_has_a_schema() -> None:
    assert {*SECTIONS.names} == {*gear2017.TOP_LEVEL}
    assert all(schema.keys() - {"description"} for schema in SCHEMA["properties"].values())


@pytest.mark.parametrize("name", all_bundled())
def test_bundled_trial_is_valid(name: str) -> None:
    assert is_valid(yaml.safe_load(find_trial(name).read_text()))


@pytest.mark.parametrize("path", EXAMPLES, ids=str)
def test_example_is_valid(path: Path) -> None:
    assert is_valid(yaml.safe_load(path.read_text()))


def test_trial_with_an_entry_in_each_section_is_valid() -> None:
    assert load_trial(text=yaml.safe_dump(WHOLE)).warnings == ()
    assert is_valid(WHOLE)


@given(path=st.sampled_from(list(places(WHOLE))), value=st.sampled_from(WRONG))
def test_single_wrong_value_is_judged_as_by_the_loader(path: tuple[Any, ...], value: Any) -> None:
    data = replaced(path, value)
    try:
        loaded = load_trial(text=yaml.safe_dump(data))
    except DescriptionError as error:
        refusals = [text for text in map(str, error.problems) if BY_KIND.search(text)]
        assert not (refusals and is_valid(data)), refusals
    else:
        assert loaded.warnings or is_valid(data) or is_read_as_another_kind(path, value)


@given(path=st.sampled_from([path for path in places(WHOLE) if is_key_of_schema(path)]))
def test_unknown_entry_is_refused_as_by_the_loader(path: tuple[Any, ...]) -> None:
    data = replaced((*path[:-1], "nonsense"), 1)
    try:
        load_trial(text=yaml.safe_dump(data))
    except DescriptionError:
        assert not is_valid(data)
    else:
        assert is_valid(data)


def test_entries_have_the_texts_of_the_documentation() -> None:
    options = SCHEMA["properties"]["options"]["properties"]
    assert options["insert_agvs"]["description"].startswith("Adds AGVs, trays and quality control sensors")
    assert "](" not in str(SCHEMA)
