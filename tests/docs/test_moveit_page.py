"""The page on MoveIt: its tables are those of the package that is written, and its names those of the cell."""

import re
from functools import cache
from pathlib import Path

from cellwright import load_trial
from cellwright.cell.controllers import STATES, TRAJECTORIES
from cellwright.cell.export.description import cell_description
from cellwright.cell.export.moveit import planned_cell
from cellwright.cell.model.arm_looks import CUP
from cellwright.cell.model.build import build_world
from cellwright.config.ur10 import WRIST_3_T_GRIPPER, WRIST_3_T_TOOL
from cellwright.middleware.ros2.packages.contents import MOVEIT
from cellwright.middleware.ros2.packages.moveit import HOME, TOOL, PlannedCell, moveit_files

PAGE = (Path(__file__).parents[2] / "docs" / "moveit.md").read_text(encoding="utf-8")


@cache
def lesson() -> PlannedCell:
    trial = load_trial("lesson")
    return planned_cell(trial, cell_description(trial, build_world(trial), MOVEIT))


def rows(heading: str) -> dict[str, str]:
    """Return the second column of a table by the names in its first, given its heading."""
    table = PAGE[PAGE.index(f"| {heading} |") :].partition("\n\n")[0]
    return dict(re.findall(r"^\| `([^`]+)` \| ([^|]*) \|", table, re.MULTILINE))


def test_table_of_files_is_complete() -> None:
    files = {path for path in moveit_files(lesson()) if "/" in path}
    assert set(rows("file of the package")) == files


def test_table_of_groups_has_their_numbers_of_joints() -> None:
    groups = lesson().groups
    found = rows("group")
    assert list(found) == [*groups, TOOL]
    for name, joints in groups.items():
        assert found[name].endswith(f", {len(joints)}")
    assert f"named state\n`{HOME}`" in PAGE


def test_cup_is_as_far_in_front_of_the_flange_as_the_page_says() -> None:
    face = WRIST_3_T_GRIPPER.position[1] + CUP.size[1] - WRIST_3_T_TOOL["tool0"].position[1]
    assert f"{1000 * face:.1f} mm in front of it" in PAGE


def test_table_of_launch_arguments_is_complete() -> None:
    launch = moveit_files(lesson())["launch/move_group.launch.py"].decode()
    assert set(rows("argument of the launch file")) == set(re.findall(r'DeclareLaunchArgument\("(\w+)"', launch))


def test_names_of_controllers_are_those_of_the_controller_manager() -> None:
    assert list(rows("controller")) == [TRAJECTORIES, STATES]
