"""The page on porting: what it says of Python 3 is so."""

import ast
import re
from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground

pytest_plugins = ["tests.ros1.fixtures"]

PAGE = (Path(__file__).parents[2] / "docs" / "porting.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("| `") and line.count("|") >= 3
]
SECTION = re.compile(r"^## (.*)$", re.MULTILINE)


def codes(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def is_python(text: str) -> bool:
    """Return whether a text parses as Python 3; a single clause counts too."""
    text = text.replace("…", "each")
    try:
        ast.parse(f"try:\n    pass\n{text}\n    pass\n" if text.startswith("except") else text)
    except SyntaxError:
        return False
    return True


def test_page_has_expected_sections_and_rows() -> None:
    assert len(ROWS) > 15
    assert {"print", "Lists in messages", "Division", "The first line"} <= set(SECTION.findall(PAGE))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_python3_code_of_table_parses(row: list[str]) -> None:
    assert codes(row[1])
    for code in codes(row[1]):
        assert is_python(code), code


@pytest.mark.parametrize(
    "gone", ['print "state:", state', "except rospy.ServiceException, error:", 'raise ValueError, "no part"', "0755"]
)
def test_python2_code_of_page_does_not_parse(gone: str) -> None:
    assert f"`{gone}`" in PAGE
    assert not is_python(gone)


def test_lists_division_and_comparison_behave_as_documented() -> None:
    assert list({f"point_{n}": n for n in range(11)}.values()) == list(range(11))
    half: Any = len("abc") / 2
    with pytest.raises(TypeError, match="'float' object cannot be interpreted as an integer"):
        range(half)
    nothing: Any = None
    with pytest.raises(TypeError):
        assert nothing < 3


def send_map_and_dict_values() -> list[str]:
    """Return the answers of rospy to messages with a map, and with the values of a dictionary."""
    import io

    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    answers = []
    point = JointTrajectoryPoint(positions=map(float, ["1"]))
    for points in ([point], {"point_0": JointTrajectoryPoint()}.values()):
        try:
            JointTrajectory(points=points).serialize(io.BytesIO())
            answers.append("sent")
        except Exception as error:
            answers.append(str(error))
    return answers


@pytest.mark.ros1
def test_rospy_refuses_map_as_documented(no_master: Ground) -> None:
    refusal, answer = no_master.client(send_map_and_dict_values).value()
    assert f"`{refusal}`" in PAGE.replace("\n", " ")
    assert answer == "sent"
