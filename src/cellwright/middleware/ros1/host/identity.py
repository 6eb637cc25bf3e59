"""As whom something that is served is known in ROS: as a cell's simulator, or as a robot's controller node."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cellwright.util.errors import UsageError

_NAME = re.compile(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_LONGEST = 255


@dataclass(frozen=True, slots=True)
class Identity:
    """A node, and what it stands for at the master.

    Attributes:
        node: its absolute name.
        what: what it is, in a word.
        tells_time: whether programs are to take their time from it: it publishes /clock, and /use_sim_time is set.
        makes_frames: whether robot_state_publisher, or in its place the node, publishes frames of its joint states.
        shared: parameters of its own that are set for everybody too where nobody else has: `robot_description`.
        alone_on: a topic on which nobody else should speak; empty for none.
    """

    node: str
    what: str
    tells_time: bool = True
    makes_frames: bool = True
    shared: tuple[str, ...] = ()
    alone_on: str = ""


SIMULATOR = Identity("/gazebo", "cell")
"""The node that the simulator of 2017 was."""


def robot(node: str, *, sim_time: bool = False) -> Identity:
    """A robot's controller node.

    Args:
        node: its name, with or without the slash in front.
        sim_time: whether time is simulated.

    Raises:
        UsageError: nobody can be called so.
    """
    return Identity(
        node_name(node),
        "robot",
        tells_time=sim_time,
        makes_frames=False,
        shared=("robot_description",),
        alone_on="/io_teleop/joint_states",
    )


def node_name(text: str) -> str:
    """A node's absolute name.

    Raises:
        UsageError: ROS takes no such name.
    """
    if not _NAME.fullmatch(text) or len(text) > _LONGEST:
        raise UsageError(
            f"{text!r:.80} is no name for a node: it must be of letters, digits and _, a letter first, "
            "as openloong_controller_node is"
        )
    return text if text.startswith("/") else f"/{text}"
