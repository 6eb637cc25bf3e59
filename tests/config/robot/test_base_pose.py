"""Base pose of a robot: quaternions (x, y, z, w) as written, of unit length as read."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Items, Leaf, Place, Problems, Table
from cellwright.config.robot.robots import read_base_pose, read_tree
from cellwright.util.pose import Pose

HERE = Place(0, "a.yml", 1)


def read(folder: Path, text: str) -> tuple[Pose, list[str]]:
    path = folder / "a.yml"
    path.write_text(f"base_pose: {text}\n")
    problems = Problems()
    pose = read_base_pose(read_tree(path, problems).get("base_pose"), Reader(problems))
    return pose, [str(problem).removeprefix(f"{path}:1: base_pose") for problem in problems.errors + problems.warnings]


def test_rounded_quaternion_is_accepted_without_warning(tmp_path: Path) -> None:
    pose, warnings = read(tmp_path, "{position: [0, 0, 0.9], orientation: [0, 0, 0.707, 0.707]}")
    assert warnings == []
    assert pose.position == pytest.approx((0, 0, 0.9))
    assert pose.yaw == pytest.approx(math.pi / 2)
    assert pose.quaternion == pytest.approx((math.sqrt(0.5), 0, 0, math.sqrt(0.5)))


def test_missing_base_pose_is_origin(tmp_path: Path) -> None:
    assert read_base_pose(None, Reader(Problems())) == Pose()
    assert read(tmp_path, "{}") == (Pose(), [])
    assert read(tmp_path, "{position: [1, 2, 3]}") == (Pose((1, 2, 3)), [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[0, 0, 0]", ": must be a mapping (got a list)"),
        ("{positon: [0, 0, 0]}", ".positon: unknown entry, ignored; did you mean position"),
        ("{position: [0, 0, 20000]}", ".position: coordinates must be within ±10000 m"),
        ("{position: [0, 0, .nan]}", ".position[2]: must be a finite number"),
        ("{position: [0, 0, yes]}", ".position[2]: must be a number (got the boolean true)"),
        ("{orientation: [0, 0, 0, 0]}", ".orientation: must be a unit quaternion x, y, z, w (got length 0)"),
        ("{orientation: [1e200, 0, 0, 0]}", ".orientation: must be a unit quaternion x, y, z, w (got length 1e+200)"),
        ("{orientation: [0, 0, 1.57]}", ".orientation: must be a list of 4 numbers, x, y, z, w (got a list of 3)"),
        ("{orientation: [0, 0, 1, 1]}", ".orientation: must be a unit quaternion (got length 1.41); it is scaled"),
    ],
)
def test_invalid_base_pose_gives_one_line(text: str, message: str, tmp_path: Path) -> None:
    (line,) = read(tmp_path, text)[1]
    assert line.startswith(message)


@given(st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=4))
def test_any_quaternion_is_normalized_or_refused(xyzw: list[float]) -> None:
    problems = Problems()
    items = Items(tuple(Leaf(value, HERE, "q") for value in xyzw), HERE, "q")
    table = Table(HERE, "base_pose")
    table.entries["orientation"] = Entry("orientation", items, HERE, "q")
    w, x, y, z = read_base_pose(table, Reader(problems)).quaternion
    assert math.hypot(w, x, y, z) == pytest.approx(1.0)
    length = math.hypot(*xyzw)
    if problems.errors:
        assert length <= 1e-6
    else:
        assert [value / length for value in xyzw] == pytest.approx([x, y, z, w])
