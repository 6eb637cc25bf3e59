"""Names in a cell: those that the cell has already."""

import pytest

from cellwright.config.arm import ARM_FRAMES
from cellwright.config.layout.names import RESERVED, NameCheck
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Place, Problems, Table


def admitted(name: str, section: str) -> bool:
    """Return whether a name of a section is accepted."""
    problems, place = Problems(), Place(0, "cell.yaml", 1)
    NameCheck(Reader(problems), {"gear_part"}).admit(Entry(name, Table(place, ""), place, ""), name, section)
    return not problems.errors


@pytest.mark.parametrize("name", sorted(RESERVED | {*ARM_FRAMES, "gear_part", "quality_control_sensor_2", "arm"}))
def test_name_of_something_else_is_refused(name: str) -> None:
    assert not admitted(name, "bins")


@pytest.mark.parametrize("name", ["", "1a", "a-b", "a b", "ä", "a/b", "a" * 61])
def test_name_that_is_no_ros_name_is_refused(name: str) -> None:
    assert not admitted(name, "bins")


def test_nothing_has_the_name_of_the_body_of_a_belt() -> None:
    problems, place = Problems(), Place(0, "cell.yaml", 1)
    check = NameCheck(Reader(problems), ())
    for name, section in (("conveyor_back", "bins"), ("back", "belts"), ("population_back", "carriers")):
        check.admit(Entry(name, Table(place, ""), place, f"cell.{section}.{name}"), name, section)
    assert [str(each).partition(": ")[2] for each in problems.errors] == [
        "cell.belts.back: cell.bins.conveyor_back has the name of its body or parts, 'conveyor_back'; choose another",
        "cell.carriers.population_back: cell.belts.back has this name (cell.yaml:1); choose another",
    ]


def test_arm_may_be_called_arm() -> None:
    assert admitted("arm", "arms")
    assert admitted("bin1", "bins")
