"""The page on ROS 2 packages: its packages and launch arguments are those that are laid out."""

import re
from pathlib import Path

from cellwright.middleware.ros2.host.installation import PYTHON_VARIABLE
from cellwright.middleware.ros2.packages.contents import LAUNCH, interface_packages, package_files
from cellwright.middleware.ros2.packages.environment import FOLDER_VARIABLE, RMW

PAGE = (Path(__file__).parents[2] / "docs" / "ros2-packages.md").read_text(encoding="utf-8")


def first_column(heading: str) -> list[str]:
    """Return the names in the first column of a table, given its heading."""
    table = PAGE[PAGE.index(f"| {heading} |") :].partition("\n\n")[0]
    return re.findall(r"^\| `([^`]+)`", table, re.MULTILINE)


def test_table_of_packages_is_complete() -> None:
    assert sorted(first_column("package")) == sorted([LAUNCH, *interface_packages()])


def test_table_of_launch_arguments_is_complete() -> None:
    launch = b"".join(content for path, content in package_files(LAUNCH).items() if path.endswith(".launch.py"))
    declared = set(re.findall(r'DeclareLaunchArgument\(\s*"(\w+)"', launch.decode()))
    assert set(first_column("launch argument")) == declared


def test_named_variables_exist() -> None:
    assert {f"`{name}`" for name in (PYTHON_VARIABLE, FOLDER_VARIABLE, RMW)} <= set(re.findall(r"`\w+`", PAGE))
