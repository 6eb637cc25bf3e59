"""Choice of the shapes that the links of an arm touch with: hulls, convex pieces, or named primitives."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import RobotModel
from cellwright.util.errors import UsageError, did_you_mean

MeshContact: TypeAlias = Literal["hull", "pieces"]
"""Shape with which a mesh touches: its one convex hull, or convex pieces."""

DEFAULT_THRESHOLD = 0.05
"""Concavity up to which a piece is not divided further, relative to the size of its mesh."""
THRESHOLDS = (0.01, 1.0)
"""Minimum and maximum threshold: below it pieces grow without number, above it none is divided."""
_LENGTHS = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1}  # numbers of a primitive's size


@dataclass(frozen=True, slots=True)
class CollisionShapes:
    """Shapes that the links of an arm touch with.

    Attributes:
        kind: `hull`: a mesh touches as its convex hull, which stands off it by up to 55 mm at a UR10;
            `pieces`: as convex pieces, which stay within 21 mm at its three largest links.
        threshold: concavity up to which a piece is not divided further, relative to the size of its mesh.
        primitives: boxes, cylinders, capsules and spheres by link, in its frame, in place of all shapes that the link
            touches with; a link with none touches nothing.

    Raises:
        UsageError: the threshold is out of range, or a shape is no primitive or has no size.

    Example:
        >>> sphere = ModelShape("sphere", (0.06, 0.0, 0.0))
        >>> CollisionShapes(primitives={"forearm_link": (sphere,)}).kind
        'hull'
    """

    kind: MeshContact = "hull"
    threshold: float = DEFAULT_THRESHOLD
    primitives: Mapping[str, tuple[ModelShape, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lower, upper = THRESHOLDS
        if not lower <= self.threshold <= upper:
            raise UsageError(
                f"collision: threshold must be from {lower:g} to {upper:g} (got {self.threshold:g}); "
                f"{DEFAULT_THRESHOLD:g} follows the largest links of a UR10 within 21 mm"
            )
        for link, shapes in self.primitives.items():
            for shape in shapes:
                lengths = shape.size[: _LENGTHS.get(shape.kind, 0)]
                if not lengths:
                    known = ", ".join(_LENGTHS)
                    raise UsageError(f"collision: {link}: must be one of {known} (got {shape.kind}); name a primitive")
                if not all(0 < length < math.inf for length in lengths):
                    shown = " ".join(f"{length:g}" for length in lengths)
                    raise UsageError(f"collision: {link}: lengths of a {shape.kind} must be above 0 m (got {shown})")

    def check(self, robot: RobotModel) -> None:
        """Compare the names of links with those of a robot.

        Raises:
            UsageError: the robot has no link of a name.
        """
        for link in self.primitives:
            if link not in robot.links:
                raise UsageError(f"collision: the robot has no link {link!r}{did_you_mean(link, robot.links)}")
