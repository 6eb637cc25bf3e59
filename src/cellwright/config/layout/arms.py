"""Arms of a layout."""

from dataclasses import dataclass

from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Arm:
    """A UR10 on a rail.

    Attributes:
        name: its name in the layout.
        pose: frame of the rail, along whose y axis the arm moves, in the world.
    """

    name: str
    pose: Pose
