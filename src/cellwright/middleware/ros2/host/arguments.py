"""Check of arguments behind `--ros-args`, before a process of ROS 2 starts that would refuse them in its own words."""

from __future__ import annotations

from collections.abc import Sequence

from cellwright.util.errors import UsageError

_RULES = {
    **dict.fromkeys(("-r", "--remap"), "-r FROM:=TO, such as -r __ns:=/cell1"),
    **dict.fromkeys(("-p", "--param"), "-p NAME:=VALUE, such as -p use_sim_time:=true"),
}
"""Options that take a rule, and its form."""


def check_ros_arguments(words: Sequence[str]) -> None:
    """Check the rules among rclpy's arguments, without `--ros-args`; other arguments are left to rclpy.

    Raises:
        UsageError: a rule is missing or has another form.

    Example:
        >>> check_ros_arguments(["-r", "__ns:=/cell1"])
    """
    rest = iter(words)
    for option in rest:
        if option not in _RULES:
            continue
        rule = next(rest, "")
        name, _, value = rule.partition(":=")
        if not name or not value:
            raise UsageError(f"--ros-args: {f'{option} {rule}'.rstrip()}: not a rule; give {_RULES[option]}")
        if name.rpartition(":")[2] == "__ns" and not value.startswith("/"):
            raise UsageError(f"--ros-args: {option} {rule}: a namespace begins with /; give {option} {name}:=/{value}")
