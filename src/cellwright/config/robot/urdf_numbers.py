"""Numbers in the attributes of URDF elements."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cellwright.config.parsing.problems import Problems
from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.urdf_file import Element
from cellwright.util.pose import Pose, Vector3

FARTHEST = 1e6
"""Largest coordinate that means anything [m; rad]."""


class Numbers:
    """Reads numbers; what is wrong with them goes to `problems`, and a stand-in is returned."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems

    def read(self, element: Element, name: str, count: int, *, may_be_infinite: bool = False) -> list[float] | None:
        """So many numbers of an attribute; None where it is missing or wrong, which is told when it is wrong."""
        text = element.get(name)
        if text is None:
            return None
        words = text.replace(",", " ").split()
        tidied = [word.removesuffix(".") if word.count(".") > 1 else word for word in words]
        try:
            found = [float(word) for word in tidied] if "_" not in text else []
        except ValueError:
            found = []
        are_fine = not any(math.isnan(value) or (math.isinf(value) and not may_be_infinite) for value in found)
        if are_fine and (len(found) == count or len(found) > count > 1):
            taken = " ".join(tidied[:count])
            if taken != " ".join(text.split()):
                self.problems.warn(element, f"{name}={shortened(text)!r} is taken for {taken}")
            return found[:count]
        what = "a finite number" if count == 1 else f"{count} finite numbers with blanks between them"
        self.problems.error(element, f"{name} takes {what}, not {shortened(text)!r}")
        return None

    def number(self, element: Element, name: str, default: float, *, may_be_infinite: bool = False) -> float:
        """One number, or the default where there is none."""
        found = self.read(element, name, 1, may_be_infinite=may_be_infinite)
        return found[0] if found else default

    def vector(self, element: Element, name: str, default: Vector3 = (0.0, 0.0, 0.0)) -> Vector3:
        """Three numbers, or the default where there are none."""
        found = self.read(element, name, 3)
        return _three(found) if found else default

    def pose(self, owner: Element) -> Pose:
        """The `<origin>` of an element; the identity where it has none."""
        origin = owner.find("origin")
        if origin is None:
            return Pose()
        position, rpy = self.vector(origin, "xyz"), self.vector(origin, "rpy")
        if max(map(abs, (*position, *rpy))) > FARTHEST:
            self.problems.error(origin, f"a coordinate beyond {FARTHEST:g}")
            return Pose()
        return Pose.from_rpy(position, rpy) if any(rpy) else Pose(position)


def _three(numbers: Sequence[float]) -> Vector3:
    x, y, z = numbers
    return (x, y, z)
