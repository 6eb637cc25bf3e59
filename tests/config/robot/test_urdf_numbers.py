"""Numbers in attributes: valid and tolerated ones."""

import pytest

from cellwright.config.parsing.tree import Place, Problems
from cellwright.config.robot.urdf_file import Element
from cellwright.config.robot.urdf_numbers import Numbers
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
    assert read(" ", 1) == (None, ["xyz must be a finite number (got '')"], [])


@pytest.mark.parametrize("text", ["1,2,3", "1, 2,3", "1,2,-3", "1.5,2,.3"])
def test_commas_that_separate_all_numbers_are_read(text: str) -> None:
    assert read(text, 3)[0] == [float(word) for word in text.split(",")]


@pytest.mark.parametrize("text", ["0,5 0 1", "0,5 0,1 0,2", "0,5, 0,1, 0,2", "1,2", "1,5 2 3 4"])
def test_decimal_commas_in_vector_are_refused_with_remedy(text: str) -> None:
    hint = "; write decimals with a point, such as 0.5"
    assert read(text, 3) == (None, [f"xyz must be 3 finite numbers with blanks between them (got '{text}'){hint}"], [])
    assert read("0,5", 1)[1] == [f"xyz must be a finite number (got '0,5'){hint}"]


def test_origin_element_becomes_pose() -> None:
    numbers = Numbers(Problems())
    place = Place(0, "r.urdf", 3)
    origin = Element("origin", {"xyz": "1 2 3", "rpy": "0 0 1.5707963267948966"}, place, "origin")
    turned = numbers.pose(Element("joint", {}, place, "joint", [origin]))
    assert turned.position == (1.0, 2.0, 3.0)
    assert turned.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
    assert numbers.pose(Element("joint", {}, place, "joint")) == Pose()


def origin(**attributes: str) -> tuple[Pose, list[str]]:
    """Return the pose of an origin, and its errors and warnings."""
    problems, place = Problems(), Place(0, "r.urdf", 3)
    element = Element("joint", {}, place, "joint", [Element("origin", attributes, place, "origin")])
    pose = Numbers(problems).pose(element)
    return pose, [each.message for each in (*problems.errors, *problems.warnings)]


def test_quaternion_of_origin_has_w_last_and_is_scaled() -> None:
    assert origin(xyz="1 2 3", quat_xyzw="0 0 0.6 0.8") == (Pose((1.0, 2.0, 3.0), (0.8, 0.0, 0.0, 0.6)), [])
    pose, (message,) = origin(quat_xyzw="0 0 3 4")
    assert pose.quaternion == pytest.approx((0.8, 0.0, 0.0, 0.6))
    assert message == "quat_xyzw must be a unit quaternion x y z w (got length 5); it is scaled"


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"quat_xyzw": "0 0 0 0"}, "quat_xyzw must be a unit quaternion x y z w (got length 0)"),
        ({"quat_xyzw": "0 0 0"}, "quat_xyzw must be 4 finite numbers with blanks between them (got '0 0 0')"),
        ({"quat_xyzw": "0 0 0 1", "rpy": "0 0 0"}, "must have either rpy or quat_xyzw (got both); remove one"),
        ({"xyz": ""}, "xyz must be 3 finite numbers with blanks between them (got '')"),
        ({"rpy": " "}, "rpy must be 3 finite numbers with blanks between them (got '')"),
    ],
)
def test_invalid_origin_is_refused(attributes: dict[str, str], message: str) -> None:
    assert origin(**attributes)[1] == [message]
