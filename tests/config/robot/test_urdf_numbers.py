"""Numbers in attributes: valid and tolerated ones."""

import pytest

from cellwright.config.parsing.tree import Place, Problems
from cellwright.config.robot.urdf_file import Element, Numbers
from cellwright.util.pose import Pose


def read(text: str, count: int, *, may_be_infinite: bool = False) -> tuple[list[float] | None, list[str], list[str]]:
    """Return the numbers, and the errors and warnings."""
    problems = Problems()
    element = Element("origin", {"xyz": text}, Place(0, "r.urdf", 3), "origin")
    found = Numbers(problems).read(element, "xyz", count, may_be_infinite=may_be_infinite)
    return found, [each.message for each in problems.errors], [each.message for each in problems.warnings]


@pytest.mark.parametrize("text", ["1 -2.5 3e-1", " 1\t-2.5\n 0.3 ", "1. -2.50 .3", "+1 -2.5 0.3"])
def test_numbers_separated_by_whitespace_are_read(text: str) -> None:
    assert read(text, 3) == ([1.0, -2.5, 0.3], [], [])


@pytest.mark.parametrize(("text", "taken"), [("1, 2,3", "1 2 3"), ("1 2 3 4", "1 2 3"), ("-1.57. 0 0", "-1.57 0 0")])
def test_tolerated_number_formats_are_read_with_warning(text: str, taken: str) -> None:
    assert read(text, 3) == ([float(word) for word in taken.split()], [], [f"xyz='{text}' is read as {taken}"])


@pytest.mark.parametrize("text", ["1 2", "1 2 nan", "1 2 x", "1 2 1_0", "1 2 inf", "0x1 2 3", "1 2 1e999"])
def test_invalid_numbers_are_refused(text: str) -> None:
    found, errors, warnings = read(text, 3)
    assert (found, warnings) == (None, [])
    assert errors == [f"xyz must be 3 finite numbers with blanks between them (got '{text}')"]


def test_single_number_is_read_or_refused() -> None:
    assert read("4", 1)[0] == [4.0]
    assert read("4 5", 1)[1] == ["xyz must be a finite number (got '4 5')"]
    assert read("inf", 1, may_be_infinite=True)[0] == [float("inf")]
    assert read("", 1) == (None, [], [])


def test_origin_element_becomes_pose() -> None:
    numbers = Numbers(Problems())
    place = Place(0, "r.urdf", 3)
    origin = Element("origin", {"xyz": "1 2 3", "rpy": "0 0 1.5707963267948966"}, place, "origin")
    turned = numbers.pose(Element("joint", {}, place, "joint", [origin]))
    assert turned.position == (1.0, 2.0, 3.0)
    assert turned.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
    assert numbers.pose(Element("joint", {}, place, "joint")) == Pose()
