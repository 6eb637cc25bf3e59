"""How many commands a node has taken and ignored. Counters are not state: they change nothing that the node does."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Counts:
    """Commands since the node was made; what is refused is counted by the bus.

    Attributes:
        taken: those that were followed.
        ignored: those that came while the node takes none, or that named no joint of the robot.
    """

    taken: int = 0
    ignored: int = 0
