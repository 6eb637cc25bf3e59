"""What a robot's controller node has on ROS's parameter server: the text of its URDF, for rviz and its like."""

from __future__ import annotations

import re
from typing import Any

DESCRIPTION = "robot_description"
"""The parameter that holds a robot's URDF, wherever ROS looks for one."""

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML may hold. URDFs that were passed on for years do, and a master cannot be told of them."""


def parameters(urdf: str, *, node: str, sim_time: bool) -> dict[str, Any]:
    """The parameters, in nested dictionaries by their names.

    Args:
        urdf: the robot's URDF; empty for none.
        node: absolute name of the node.
        sim_time: whether time is simulated, and told on /clock.
    """
    found: dict[str, Any] = {"use_sim_time": True} if sim_time else {}
    if urdf:
        found[node.strip("/")] = {DESCRIPTION: _NOT_XML.sub("", urdf)}
    return found
