"""Layout of Python 2's dictionaries, against figures that the original itself left behind."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing.python2 import dictionary_order, number_text, quotient, scalar_text
from tests.conftest import DATA

TRIALS: dict[str, Any] = json.loads((DATA / "gear2017_trials.json").read_text())["trials"]


@pytest.mark.parametrize("name", [name for name, trial in TRIALS.items() if trial["resolved"]["faulty"]])
def test_faulty_parts_are_in_order_of_two_dictionaries(name: str) -> None:
    written = TRIALS[name]["config"]["faulty_parts"]
    assert dictionary_order(dictionary_order(written)) == TRIALS[name]["resolved"]["faulty"]


def test_bins_are_in_order_that_numbered_their_parts() -> None:
    models = TRIALS["comp_conf2"]["resolved"]["models"]
    first: dict[str, int] = {}
    for name, *_ in models:
        bin_name, _, part = name.partition("|")
        number = int(part.rpartition("_")[2])
        first[bin_name] = min(number, first.get(bin_name, number))
    walked = dictionary_order(TRIALS["comp_conf2"]["config"]["models_over_bins"])
    assert walked == sorted(first, key=lambda name: first[name])
    assert walked != list(TRIALS["comp_conf2"]["config"]["models_over_bins"])


def test_dictionary_order_of_known_keys_is_python_2_order() -> None:
    # Small whole numbers are their own hashes, so they are sorted; 8 wraps around in a table of eight.
    assert dictionary_order([5, 3, 1]) == [1, 3, 5]
    assert dictionary_order([8, 1]) == [8, 1]
    assert dictionary_order([3.0, 2]) == [2, 3.0]
    assert dictionary_order([-1, 5]) == [5, -1]
    # The best-known example: {'a', 'b', 'c'} of Python 2 on 64 bits prints as a, c, b.
    assert dictionary_order(["a", "b", "c"]) == ["a", "c", "b"]


keys = st.lists(st.one_of(st.text(max_size=12), st.integers(), st.floats(), st.none(), st.booleans()), max_size=40)


@given(keys)
def test_dictionary_order_has_each_key_once(some: list[object]) -> None:
    walked = dictionary_order(some)
    assert len(walked) == len(dict.fromkeys(some))
    assert set(map(id, walked)) <= set(map(id, some))


@given(st.integers(0, 2**40), st.integers(1, 2**40))
def test_quotient_of_whole_numbers_is_whole(a: int, b: int) -> None:
    assert quotient(a, b) == a // b
    assert quotient(float(a), b) == a / b


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.0, "0.0"), (0, "0"), (3.141592653589793, "3.14159265359"), (-0.1, "-0.1"), (1e22, "1e+22"), (1e-7, "1e-07")],
)
def test_number_text_equals_python_2_str(number: float, text: str) -> None:
    assert number_text(number) == scalar_text(number) == text
