"""Surroundings of a cell's devices: structure, lines on the floor, views and named places.

All poses are in the world frame, lengths in m, angles in rad.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cellwright.util.pose import Pose, Vector3


@dataclass(frozen=True, slots=True)
class Block:
    """Box of a structure.

    Attributes:
        middle: its middle, in the frame of the structure.
        size: edge lengths along x, y and z of `middle`.
    """

    middle: Pose
    size: Vector3


@dataclass(frozen=True, slots=True)
class Structure:
    """Fixed thing of boxes: a portal for sensors, a fence, a post or a table.

    Attributes:
        name: name of its body.
        pose: frame of its boxes.
        boxes: boxes that parts and arms touch, and that are drawn.
        drawn: boxes that are only drawn: they cost no time in a step.

    Example:
        >>> post = Structure("post", Pose((1.0, 0.0, 0.0)), (Block(Pose((0.0, 0.0, 1.0)), (0.1, 0.1, 2.0)),))
        >>> post.moved(Pose((0.0, 2.0, 0.0))).pose.position
        (1.0, 2.0, 0.0)
    """

    name: str
    pose: Pose
    boxes: tuple[Block, ...] = ()
    drawn: tuple[Block, ...] = ()

    def moved(self, by: Pose) -> Structure:
        """Return the structure moved by a pose of the world."""
        return replace(self, pose=by @ self.pose)


@dataclass(frozen=True, slots=True)
class FloorLine:
    """Line on the floor.

    Attributes:
        middle: its middle, at height 0.
        size: edge lengths along x and y of `middle`.
    """

    middle: Pose
    size: tuple[float, float]

    def moved(self, by: Pose) -> FloorLine:
        """Return the line moved by a pose of the world."""
        return replace(self, middle=by @ self.middle)


@dataclass(frozen=True, slots=True)
class View:
    """Camera preset: a named place to look at the cell from.

    Attributes:
        name: its name, as for `--camera` and the buttons of the page.
        position: place of the camera.
        target: point in the middle of the picture.
        angle: vertical opening angle.
    """

    name: str
    position: Vector3
    target: Vector3
    angle: float

    def moved(self, by: Pose) -> View:
        """Return the view moved by a pose of the world."""
        return replace(self, position=by.transform(self.position), target=by.transform(self.target))


@dataclass(frozen=True, slots=True)
class Place:
    """Named pose of the user's, such as a place to put something aside."""

    name: str
    pose: Pose

    def moved(self, by: Pose) -> Place:
        """Return the place moved by a pose of the world."""
        return replace(self, pose=by @ self.pose)
