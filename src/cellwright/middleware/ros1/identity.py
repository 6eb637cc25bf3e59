"""Identity of a node in ROS 1, and the form of its name."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cellwright.util.errors import UsageError

_NODE_NAME = re.compile(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_MAX_NAME_LENGTH = 255


@dataclass(frozen=True, slots=True)
class Identity:
    """Identity of a node at the master.

    Attributes:
        node: its absolute name.
        kind: its kind, in a word.
        tells_time: true if it publishes /clock, with /use_sim_time set.
        frame_source: topic of joint states from which robot_state_publisher, or else the node, computes frames; empty
            if neither does.
        subscribes: topics of its own that it also subscribes to in the graph, without a connection.
        shared: own parameters that it also sets globally, unless another program has.
        exclusive_topic: topic on which no other node should publish; empty for none.
        rival: another program under its name, in words; empty if it is just a node.

    Example:
        >>> Identity(node_name("arm"), "robot", tells_time=False).node
        '/arm'
    """

    node: str
    kind: str
    tells_time: bool = True
    frame_source: str = ""
    subscribes: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    exclusive_topic: str = ""
    rival: str = ""


def node_name(text: str) -> str:
    """Return a node's absolute name; a UsageError if ROS does not accept the name."""
    if not _NODE_NAME.fullmatch(text) or len(text) > _MAX_NAME_LENGTH:
        raise UsageError(
            f"{text!r:.80} is not a node name; use letters, digits and _, with a letter first, "
            "like openloong_controller_node"
        )
    return text if text.startswith("/") else f"/{text}"
