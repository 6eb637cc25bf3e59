"""Starts MoveIt for the arms of a running cell: `ros2 launch cellwright_moveit_config move_group.launch.py rviz:=true`.

The description is that of this package, with all that stands in the cell. The cell publishes joint states and frames:
no other node may do so beside it.
"""

from typing import Any

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from moveit_configs_utils import MoveItConfigsBuilder

PACKAGE = "cellwright_moveit_config"
RELATIVE = [(f"/{name}", name) for name in ("clock", "tf", "tf_static")]
"""Names that MoveIt takes as absolute, and that a cell in a namespace has there."""


def start(context: Any, *_arguments: Any, **_keywords: Any) -> list[Any]:
    """Return the actions that start MoveIt, for the values of the launch arguments."""

    def value(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    namespace = "/" + value("namespace").strip("/")
    config = MoveItConfigsBuilder("cellwright", package_name=PACKAGE)
    config = config.planning_pipelines(pipelines=["ompl"]).to_moveit_configs()
    of_cell = {"use_sim_time": True, "ros_control_namespace": namespace}
    shared = {"namespace": namespace, "remappings": RELATIVE, "output": "screen"}
    actions = [
        Node(
            package="moveit_ros_move_group",
            executable="move_group",
            # the limits once more: in some versions those of Pilz replace them
            parameters=[config.to_dict(), config.joint_limits, of_cell, {"publish_robot_description_semantic": True}],
            **shared,
        )
    ]
    if value("rviz").lower() in ("true", "1"):
        actions.append(
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", str(config.package_path / "config" / "moveit.rviz")],
                parameters=[
                    config.robot_description,
                    config.robot_description_semantic,
                    config.planning_pipelines,
                    config.robot_description_kinematics,
                    config.joint_limits,
                    {"use_sim_time": True},
                ],
                **shared,
            )
        )
    return actions


def generate_launch_description() -> Any:
    """Return the launch arguments, and MoveIt."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of the cell's names."),
            DeclareLaunchArgument("rviz", default_value="false", description="Also start RViz."),
            OpaqueFunction(function=start),
        ]
    )
