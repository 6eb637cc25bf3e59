"""Tests of a robot's table at any width: names stay whole, and figures are left out before that."""

from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console

from cellwright.cli import robot as robot_table
from cellwright.config.robot.config import RangeEnd, RobotConfig
from cellwright.config.robot.robots import load_robot


@pytest.fixture(scope="module")
def tandem() -> RobotConfig:
    return load_robot("tandem", lambda _line: None)


def shown(config: RobotConfig, width: int, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    file = StringIO()
    monkeypatch.setattr(robot_table, "_console", lambda: Console(file=file, width=width, highlight=False))
    robot_table.show_robot(config)
    return file.getvalue().splitlines()


def test_table_on_wide_terminal_has_all_columns(tandem: RobotConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = shown(tandem, 120, monkeypatch)
    assert lines[2].split() == [
        "#",
        "joint",
        "type",
        "link",
        "on",
        "lower",
        "upper",
        "effort",
        "speed",
        "group",
        "home",
    ]
    assert len(lines[4].split()) == 11
    assert not any(line.startswith("left out") for line in lines)


def test_table_in_100_columns_keeps_names_whole(tandem: RobotConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = shown(tandem, 100, monkeypatch)
    assert lines[2].split() == ["#", "joint", "type", "link", "on", "lower", "upper", "group", "home"]
    assert [line.split()[1] for line in lines[4:25]] == [joint.name for joint in tandem.robot.joints]
    assert max(map(len, lines[2:25])) <= 100
    assert "left out    effort and speed; they need a terminal of 108 columns, or `| cat`" in lines


@pytest.mark.parametrize("width", [40, 60, 80])
def test_table_on_narrow_terminal_folds_names_and_cuts_nothing(
    width: int, tandem: RobotConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = shown(tandem, width, monkeypatch)
    table = lines[2 : lines.index("", 3)]
    assert "…" not in "".join(table)
    if width == 80:  # on a narrower terminal the table is wider than it: no name is broken in a word
        assert max(map(len, table)) <= width


def test_table_of_robot_of_one_link_has_no_joints(tandem: RobotConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    single = tandem.robot.__class__("post", "base", {"base": tandem.robot.links["base"]}, ())
    lines = shown(RobotConfig(single, "post", tandem.path, tandem.urdf_path), 80, monkeypatch)
    assert lines[0] == "post: 0 joints; root link base (-1)"


def test_notes_show_gripper_ends_and_acceleration_bounds(tandem: RobotConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    right, left = tandem.grippers
    ends = tuple(RangeEnd.UPPER for _ in right.joints)
    changed = replace(tandem, grippers=(replace(right, open_ends=ends), left), max_accelerations={"lift": 0.5})
    lines = shown(changed, 120, monkeypatch)
    assert "gripper R   open at the upper limits of its joints" in lines
    assert "bounds      accelerations [rad/s²; m/s²]: lift 0.5" in lines
    assert not any(line.startswith("gripper L") for line in lines)
