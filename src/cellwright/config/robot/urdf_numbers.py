"""Numbers in the attributes of a URDF: single ones, vectors, and the poses of `<origin>`.

The reader tolerates, with a warning, what other programs of the field tolerate if it has one meaning: `1, 2, 3` is
three numbers, and `0,5 1 2` is refused.
"""

import math
import re

from cellwright.config.parsing.tree import Problems, shortened
from cellwright.config.robot.urdf_file import Element
from cellwright.util.pose import Pose, Vector3, normalized

MAX_COORDINATE = 1e6
"""Maximum valid coordinate [m; rad]."""

_NORM_TOLERANCE = 0.01  # of a quaternion's length before a warning: 0.707 is rounding
_INNER_COMMA = re.compile(r"[0-9.],[0-9.+-]")


class Numbers:
    """Reader of numbers; errors go to `problems`, and a default is returned."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems

    def read(self, element: Element, name: str, count: int, *, may_be_infinite: bool = False) -> list[float] | None:
        """Return `count` numbers of an attribute; None if it is missing or wrong; wrong ones are reported."""
        text = element.attributes.get(name)
        if text is None:
            return None
        text = text.strip()
        words = [word.removesuffix(".") if word.count(".") > 1 else word for word in _words(text, count)]
        try:
            found = [float(word) for word in words] if "_" not in text else []
        except ValueError:
            found = []
        are_valid = not any(math.isnan(value) or (math.isinf(value) and not may_be_infinite) for value in found)
        if are_valid and (len(found) == count or len(found) > count > 1):
            used = " ".join(words[:count])
            if used != " ".join(text.split()):
                self.problems.warn(element, f"{name}={shortened(text)!r} is read as {used}")
            return found[:count]
        expected = "a finite number" if count == 1 else f"{count} finite numbers with blanks between them"
        hint = "; write decimals with a point, such as 0.5" if _INNER_COMMA.search(text) else ""
        self.problems.error(element, f"{name} must be {expected} (got {shortened(text)!r}){hint}")
        return None

    def number(self, element: Element, name: str, default: float, *, may_be_infinite: bool = False) -> float:
        """Return one number, or the default if there is none."""
        found = self.read(element, name, 1, may_be_infinite=may_be_infinite)
        return found[0] if found else default

    def vector(self, element: Element, name: str, default: Vector3 = (0.0, 0.0, 0.0)) -> Vector3:
        """Return three numbers, or the default if there are none."""
        x, y, z = self.read(element, name, 3) or default
        return (x, y, z)

    def pose(self, owner: Element) -> Pose:
        """Return the `<origin>` of an element; the identity by default."""
        origin = owner.find("origin")
        if origin is None:
            return Pose()
        position, rpy = self.vector(origin, "xyz"), self.vector(origin, "rpy")
        if max(map(abs, (*position, *rpy))) > MAX_COORDINATE:
            self.problems.error(origin, f"coordinates must be within ±{MAX_COORDINATE:g} [m; rad]")
            return Pose()
        if "quat_xyzw" in origin.attributes:
            return self._turned(origin, position)
        return Pose.from_rpy(position, rpy) if any(rpy) else Pose(position)

    def _turned(self, origin: Element, position: Vector3) -> Pose:
        """Return the pose of an `<origin>` with a quaternion, as in version 1.2 of URDF."""
        numbers = self.read(origin, "quat_xyzw", 4)
        if "rpy" in origin.attributes:
            self.problems.error(origin, "must have either rpy or quat_xyzw (got both); remove one")
        if numbers is None:
            return Pose(position)
        x, y, z, w = numbers
        length = math.hypot(x, y, z, w)
        if not 1e-6 < length < 1e6:
            self.problems.error(origin, f"quat_xyzw must be a unit quaternion x y z w (got length {length:g})")
        elif abs(length - 1.0) > _NORM_TOLERANCE:
            message = f"quat_xyzw must be a unit quaternion x y z w (got length {length:.3g}); it is scaled"
            self.problems.warn(origin, message)
        return Pose(position, normalized((w, x, y, z)))


def _words(text: str, count: int) -> list[str]:
    """Return the numbers of a text as words.

    Commas may separate them as blanks do. A comma between two digits may also be a decimal one: there the commas must
    separate exactly `count` numbers.
    """
    if not _INNER_COMMA.search(text):
        return text.replace(",", " ").split()
    parts = [part.strip() for part in text.split(",")]
    return parts if len(parts) == count else [text]
