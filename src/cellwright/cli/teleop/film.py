"""`--video` of a robot."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.rendering.video_wish import VideoWish
from cellwright.robot.node import RobotNode
from cellwright.robot.pictures import robot_camera, robot_lamp
from cellwright.viewer.filming import Filming, still


def film(node: RobotNode, wanted: VideoWish, *, waits: bool, warn: Callable[[str], None]) -> Filming:
    """A video of a robot, which is seen whole as it stands now, with the time in its corner.

    Args:
        node: whose robot it is.
        wanted: what was asked for.
        waits: hold time until a frame can be drawn.
        warn: takes a line about what goes wrong.

    Raises:
        RenderingError: it cannot be written.
    """
    camera = wanted.camera or robot_camera(node.world, node.simulation.data, wanted.width, wanted.height)
    return Filming(
        node,
        wanted,
        camera=still(camera),
        caption=lambda: f"{node.simulation.time:.1f} s",
        waits=waits,
        warn=warn,
        lamp=robot_lamp(camera),
    )
