"""Starts a @KIND@: `ros2 launch cellwright @KIND@.launch.py @SUBJECT@:=@DEFAULT@ namespace:=@KIND@1`.

Cellwright does the work, under its own Python; the bridge to ROS 2 is a child of it.
"""

import shlex
from typing import Any

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

PYTHON = "@CELLWRIGHT_PYTHON@"
PLACE = "@CELLWRIGHT_PLACE@"
START = "import sys; sys.path.append(sys.argv.pop(1)); from cellwright.__main__ import main; sys.exit(main())"


def start(context: Any, *_arguments: Any, **_keywords: Any) -> list[Any]:
    """Return the action that starts it, for the values of the launch arguments."""

    def value(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    rules = value("remap").split()
    if value("namespace").strip("/"):
        rules.append("__ns:=/" + value("namespace").strip("/"))
    command = [PYTHON, "-E", "-P", "-u", "-c", START, PLACE]
    command += ["@COMMAND@", value("@SUBJECT@"), "--ros2", *shlex.split(value("options"))]
    if rules:
        command += ["--ros-args", *(word for rule in rules for word in ("-r", rule))]
    return [ExecuteProcess(cmd=command, name="cellwright_@KIND@", output="screen")]


def generate_launch_description() -> Any:
    """Return the launch arguments, and what starts the @KIND@."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "@SUBJECT@", default_value="@DEFAULT@", description="Bundled @SUBJECT@, or a @FILE@ file."
            ),
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of its names."),
            DeclareLaunchArgument("remap", default_value="", description="Rules FROM:=TO, separated by spaces."),
            DeclareLaunchArgument("options", default_value="", description="Other options of `cellwright @COMMAND@`."),
            OpaqueFunction(function=start),
        ]
    )
