"""Joints of a URDF: types, axes, limits as in PyBullet, and the joints that follow others."""

import math
from collections.abc import Sequence
from dataclasses import replace

from cellwright.config.parsing.tree import Definition, shortened
from cellwright.config.robot.model import Joint, JointType, Limits, Mimic
from cellwright.config.robot.urdf_file import Element
from cellwright.config.robot.urdf_numbers import MAX_COORDINATE, Numbers
from cellwright.util.errors import did_you_mean, suggestion
from cellwright.util.pose import Vector3

UNLIMITED = 1e9
"""Figures from here on mean no limit [rad; m; N m; N; rad/s; m/s]."""
_AXIS_TOLERANCE = 1e-3  # tolerance of an axis's length, for rounding
_CUT_SHARE = 0.01  # share of a follower's range that its own limits may cut off unreported, for rounding
_MAX_SUGGESTION_JOINTS = 200  # number of joints up to which similar names are searched, which is slow
_NO_AXIS = (0.0, 0.0, 0.0)


class JointReader:
    """Reader of single joints that collects what one warning reports of all of them."""

    def __init__(self, numbers: Numbers) -> None:
        self._numbers = numbers
        self._problems = numbers.problems
        self._elements: dict[str, Element] = {}
        self.without_effort: list[str] = []
        self.without_velocity: list[str] = []

    def read(self, element: Element) -> Joint | None:
        """Return the joint in an element; None if it is invalid, which is reported."""
        name = element.get("name")
        if name is None:
            self._problems.error(element, "the joint has no name")
            return None
        if name in self._elements:
            first = self._elements[name].place
            self._problems.error(element, f"duplicate joint name (first at {first}); choose another")
            return None
        self._elements[name] = element
        type_ = self._type(element)
        parent, child = self._link(element, "parent"), self._link(element, "child")
        if type_ is None or parent is None or child is None:
            return None
        origin = self._numbers.pose(element)
        if type_ is JointType.FLOATING:
            message = "a floating joint inside a robot is treated as fixed, as in PyBullet"
            self._problems.warn(element, message)
            type_ = JointType.FIXED
        axis = self._axis(element, type_)
        limits, mimic = self._limits(element, type_), self._mimic(element)
        return Joint(name, type_, parent, child, origin, axis, limits, mimic, Definition(element.place, element.key))

    def element_of(self, joint: Joint) -> Element:
        """Return the element of a joint."""
        return self._elements[joint.name]

    def _type(self, element: Element) -> JointType | None:
        text = element.get("type")
        if text is None:
            self._problems.error(element, f"the joint has no type (known: {', '.join(JointType)})")
        elif text in tuple(JointType):
            return JointType(text)
        else:
            self._problems.error(element, f"unknown joint type {shortened(text)!r}{suggestion(text, JointType)}")
        return None

    def _link(self, element: Element, tag: str) -> str | None:
        found = element.find(tag)
        name = found.get("link") if found is not None else None
        if name is None:
            self._problems.error(found or element, f'the joint requires <{tag} link="…"/>')
        return name

    def _axis(self, element: Element, type_: JointType) -> Vector3:
        """Return the unit vector of the axis; (0, 0, 0) for types without one."""
        if not type_.is_driven and type_ is not JointType.PLANAR:
            return _NO_AXIS
        written = element.find("axis")
        if written is None:
            return (1.0, 0.0, 0.0)
        if "xyz" not in written.attributes:
            self._problems.error(written, '<axis> requires xyz, such as <axis xyz="0 0 1"/>')
            return (1.0, 0.0, 0.0)
        axis = self._numbers.vector(written, "xyz", (1.0, 0.0, 0.0))
        length = math.hypot(*axis)
        if not 1e-9 < length < math.inf:
            self._problems.error(written, "the axis has no direction; write a unit vector such as 0 0 1")
            return (1.0, 0.0, 0.0)
        if type_ is JointType.PRISMATIC and abs(length - 1.0) > _AXIS_TOLERANCE:
            message = (
                f"the axis must be a unit vector (got length {length:g}); only its direction is used "
                "(PyBullet scales the motion by the length)"
            )
            self._problems.warn(written, message)
        x, y, z = (value / length for value in axis)
        return (x, y, z)

    def _limits(self, element: Element, type_: JointType) -> Limits:
        """Return the joint's limits. Lower above upper sets no bounds; neither does effort or velocity of 0."""
        if not type_.is_driven:
            return Limits()
        written = element.find("limit")
        if written is None and type_ is not JointType.CONTINUOUS:
            message = f'a {type_} joint requires <limit lower="…" upper="…" effort="…" velocity="…"/>'
            self._problems.error(element, message)
        names = ("lower", "upper", "effort", "velocity")
        lower, upper, effort, velocity = (self._limit(written, name) if written else 0.0 for name in names)
        is_bounded = written is not None and (written.get("lower") or written.get("upper"))
        if not is_bounded or lower > upper or type_ is JointType.CONTINUOUS:
            lower, upper = -math.inf, math.inf
        limits = Limits(lower, upper, abs(effort) or math.inf, abs(velocity) or math.inf)
        if math.isinf(limits.effort):
            self.without_effort.append(element.get("name") or "")
        if math.isinf(limits.velocity):
            self.without_velocity.append(element.get("name") or "")
        return limits

    def _limit(self, element: Element, name: str) -> float:
        value = self._numbers.number(element, name, 0.0, may_be_infinite=True)
        return value if abs(value) < UNLIMITED else math.copysign(math.inf, value)

    def _mimic(self, element: Element) -> Mimic | None:
        written = element.find("mimic")
        if written is None:
            return None
        leader = written.get("joint")
        if leader is None:
            self._problems.error(written, '<mimic> requires joint="…", the joint to follow')
            return None
        number = self._numbers.number
        return Mimic(leader, number(written, "multiplier", 1.0), number(written, "offset", 0.0))

    def with_resolved_mimics(self, joints: Sequence[Joint]) -> list[Joint]:
        """Return the joints, with each mimic joint coupled to the head of its chain."""
        by_name = {joint.name: joint for joint in joints}
        resolved = [replace(joint, mimic=self._first_leader(joint, by_name)) for joint in joints]
        return [self._with_range(joint, by_name) for joint in resolved]

    def _with_range(self, joint: Joint, joints: dict[str, Joint]) -> Joint:
        """Return a mimic joint with a range to follow in, and report one that it cannot follow in completely.

        Exporters write limits from 0 to 0 for joints without limits: such a follower takes the range that it needs.
        """
        mimic = joint.mimic
        if mimic is None:
            return joint
        own, leader = joint.limits, joints[mimic.joint].limits
        lower, upper = sorted(_followed(mimic, end) for end in (leader.lower, leader.upper))
        slack = max(_CUT_SHARE * (upper - lower) if math.isfinite(upper - lower) else 0.0, 1e-9)
        if own.lower - slack <= lower and upper <= own.upper + slack:
            return joint
        element = self.element_of(joint)
        positions = f"{lower:.4g} to {upper:.4g}" if lower > -math.inf or upper < math.inf else "any position"
        asked = f"{shortened(mimic.joint)!r} asks for {positions}"
        if own.lower == own.upper:
            message = f"the follower's own limits allow no motion, and {asked}; it follows without limits of its own"
            self._problems.warn(element.find("limit") or element, message)
            return replace(joint, limits=replace(own, lower=lower, upper=upper))
        stands = own.upper <= lower or upper <= own.lower
        effect = "it stands still" if stands else "it stops at its own limits"
        message = f"the follower's own limits allow {own.lower:.4g} to {own.upper:.4g}, and {asked}; {effect}"
        self._problems.warn(element.find("limit") or element, message)
        return joint

    def _first_leader(self, joint: Joint, joints: dict[str, Joint]) -> Mimic | None:
        mimic = joint.mimic
        if mimic is None:
            return None
        element = self.element_of(joint).find("mimic") or self.element_of(joint)
        if not joint.is_driven:
            self._problems.warn(element, f"a {joint.type} joint cannot follow another; <mimic> is ignored")
            return None
        chain = {joint.name: None}
        while True:
            leader, reason = joints.get(mimic.joint), ""
            if leader is None:
                hint = did_you_mean(mimic.joint, joints) if len(joints) <= _MAX_SUGGESTION_JOINTS else ""
                reason = f"mimics the unknown joint {shortened(mimic.joint)!r}{hint}"
            elif leader.name in chain:
                reason = f"joints mimic each other in a loop: {', '.join(list(chain)[:5])}"
            elif not leader.is_driven:
                reason = f"mimics {shortened(leader.name)!r}, a {leader.type} joint"
            elif max(abs(mimic.multiplier), abs(mimic.offset)) > MAX_COORDINATE:
                reason = f"mimics {shortened(leader.name)!r} with a multiplier or offset beyond {MAX_COORDINATE:g}"
            if leader is None or reason:
                self._problems.error(element, reason)
                return None
            if leader.mimic is None:
                return mimic
            chain[leader.name] = None
            further = leader.mimic
            offset = mimic.multiplier * further.offset + mimic.offset
            mimic = Mimic(further.joint, mimic.multiplier * further.multiplier, offset)


def _followed(mimic: Mimic, leader: float) -> float:
    """Return the position to which a position of its leader moves a mimic joint, also if that is infinite."""
    return mimic.multiplier * leader + mimic.offset if mimic.multiplier else mimic.offset
