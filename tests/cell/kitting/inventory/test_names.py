import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.inventory import part_type, trimmed_name

WORDS = st.text("abcdefghijklmnopqrstuvwxyz", min_size=2, max_size=8)
TYPES = st.lists(WORDS.filter(lambda word: not word.startswith("clone")), min_size=1, max_size=3).map("_".join)


@pytest.mark.parametrize(
    ("name", "trimmed", "type_"),
    [
        ("a|b|gear_part_clone_12", "gear_part_clone_12", "gear_part"),
        ("bin8|part4_20", "part4_20", "part4"),
        ("bin8|part4", "part4", "part4"),
        ("x|gear_part_clone", "gear_part_clone", "gear_part"),
        ("gear_part_clone_1_clone_2", "gear_part_clone_1_clone_2", "gear_part_clone_1"),
        ("", "", ""),
        ("|", "", ""),
        ("_clone_3", "_clone_3", "_clone"),
        ("gear_part_", "gear_part_", "gear_part_"),
        ("gear_part_\u0663", "gear_part_\u0663", "gear_part_\u0663"),
    ],
)
def test_trimmed_name_and_part_type_of_model_name(name: str, trimmed: str, type_: str) -> None:
    assert trimmed_name(name) == trimmed
    assert part_type(name) == type_


@pytest.mark.slow
@given(TYPES, st.lists(WORDS, max_size=3), st.integers(0, 10**6))
def test_part_type_is_found_behind_any_origin_and_number(type_: str, origin: list[str], number: int) -> None:
    for suffix in ("", f"_{number}", f"_clone_{number}"):
        name = "|".join([*origin, type_ + suffix])
        assert part_type(name) == type_
        assert trimmed_name(name) == type_ + suffix
