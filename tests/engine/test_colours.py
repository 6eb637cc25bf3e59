"""Colours of the cell: opaque, in range, and different for each part type."""

from cellwright.engine import colours
from cellwright.engine.shapes import rgb

ALL = {name: value for name, value in vars(colours).items() if name.isupper()}


def test_colours_are_opaque_and_in_range() -> None:
    assert len(ALL) > 30
    assert all(
        len(each) == 4 and each[3] == 1.0 and all(0.0 <= value <= 1.0 for value in each) for each in ALL.values()
    )


def test_red_comes_first() -> None:
    assert rgb(0xFF8000) == (1.0, 128 / 255, 0.0, 1.0)


def test_parts_have_colours_of_their_own() -> None:
    parts = [ALL[name] for name in ("GEAR", "PISTON", "GASKET", "DISK", "PULLEY", "PART1", "PART2", "PART3", "PART4")]
    assert len(set(parts)) == len(parts)
