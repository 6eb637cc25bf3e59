"""The `<joint>` elements of a URDF file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.model import DRIVEN, Joint, JointType, Limits, Mimic
from cellwright.config.robot.urdf_file import Element
from cellwright.config.robot.urdf_numbers import FARTHEST, Numbers
from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Vector3

ENDLESS = 1e9
"""Figures from here on mean that there is no limit [rad; m; N m; N; rad/s; m/s]."""

_UNIT = 1e-3  # axes within this of unit length are rounded ones
_FEW = 200  # joints whose names are searched for similar ones: that takes long
_NO_AXIS = (0.0, 0.0, 0.0)


class JointReader:
    """Reads joints one by one, and remembers what is to be told of all of them together."""

    def __init__(self, numbers: Numbers) -> None:
        self._numbers = numbers
        self._problems = numbers.problems
        self._elements: dict[str, Element] = {}
        self.without_effort: list[str] = []
        self.without_velocity: list[str] = []

    def read(self, element: Element) -> Joint | None:
        """The joint in an element; None where it cannot be made sense of, which is told."""
        name = element.get("name")
        if name is None:
            self._problems.error(element, "a joint without a name")
            return None
        if name in self._elements:
            first = self._elements[name].place
            self._problems.error(element, f"there is a joint of this name already ({first}); names have to be unique")
            return None
        self._elements[name] = element
        type_ = self._type(element)
        parent, child = self._link(element, "parent"), self._link(element, "child")
        if type_ is None or parent is None or child is None:
            return None
        origin = self._numbers.pose(element)
        if type_ is JointType.FLOATING:
            message = "a floating joint inside a robot is held fixed, as PyBullet does with it"
            self._problems.warn(element, message)
            type_ = JointType.FIXED
        axis = self._axis(element, type_)
        return Joint(name, type_, parent, child, origin, axis, self._limits(element, type_), self._mimic(element))

    def element_of(self, joint: Joint) -> Element:
        """Where a joint stands."""
        return self._elements[joint.name]

    def _type(self, element: Element) -> JointType | None:
        text = element.get("type")
        if text is None:
            self._problems.error(element, f"a joint without a type (known: {', '.join(JointType)})")
        elif text in tuple(JointType):
            return JointType(text)
        else:
            hint = did_you_mean(text, JointType) or f" (known: {', '.join(JointType)})"
            self._problems.error(element, f"unknown joint type {shortened(text)!r}{hint}")
        return None

    def _link(self, element: Element, tag: str) -> str | None:
        found = element.find(tag)
        name = found.get("link") if found is not None else None
        if name is None:
            self._problems.error(found or element, f'a joint needs <{tag} link="…"/>')
        return name

    def _axis(self, element: Element, type_: JointType) -> Vector3:
        """The unit vector of the axis; (0, 0, 0) where it means nothing."""
        if type_ not in (*DRIVEN, JointType.PLANAR):
            return _NO_AXIS
        written = element.find("axis")
        if written is None:
            return (1.0, 0.0, 0.0)
        axis = self._numbers.vector(written, "xyz", (1.0, 0.0, 0.0))
        length = math.hypot(*axis)
        if not 1e-9 < length < math.inf:
            self._problems.error(written, "an axis of no direction; give a unit vector such as 0 0 1")
            return (1.0, 0.0, 0.0)
        if type_ is JointType.PRISMATIC and abs(length - 1.0) > _UNIT:
            message = (
                f"the axis has a length of {length:g}; its direction alone is taken (PyBullet stretches the way by it)"
            )
            self._problems.warn(written, message)
        x, y, z = (value / length for value in axis)
        return (x, y, z)

    def _limits(self, element: Element, type_: JointType) -> Limits:
        """What the joint can do. Lower above upper sets no bounds; neither does effort or velocity of 0."""
        if type_ not in DRIVEN:
            return Limits()
        written = element.find("limit")
        if written is None:
            if type_ is not JointType.CONTINUOUS:
                message = f'a {type_} joint needs <limit lower="…" upper="…" effort="…" velocity="…"/>'
                self._problems.error(element, message)
            self._note(element, Limits())
            return Limits()
        lower, upper, effort, velocity = (
            self._limit(written, name) for name in ("lower", "upper", "effort", "velocity")
        )
        if (written.get("lower") is None and written.get("upper") is None) or lower > upper:
            lower, upper = -math.inf, math.inf
        if type_ is JointType.CONTINUOUS:
            lower, upper = -math.inf, math.inf
        limits = Limits(lower, upper, abs(effort) or math.inf, abs(velocity) or math.inf)
        self._note(element, limits)
        return limits

    def _limit(self, element: Element, name: str) -> float:
        value = self._numbers.number(element, name, 0.0, may_be_infinite=True)
        return value if abs(value) < ENDLESS else math.copysign(math.inf, value)

    def _note(self, element: Element, limits: Limits) -> None:
        name = element.get("name") or ""
        if math.isinf(limits.effort):
            self.without_effort.append(name)
        if math.isinf(limits.velocity):
            self.without_velocity.append(name)

    def _mimic(self, element: Element) -> Mimic | None:
        written = element.find("mimic")
        if written is None:
            return None
        leader = written.get("joint")
        if leader is None:
            self._problems.error(written, 'mimic needs joint="…", the joint to follow')
            return None
        multiplier, offset = (
            self._numbers.number(written, "multiplier", 1.0),
            self._numbers.number(written, "offset", 0.0),
        )
        return Mimic(leader, multiplier, offset)

    # ---------------------------------------------------------------- all joints together

    def with_leaders(self, joints: Sequence[Joint]) -> list[Joint]:
        """The joints, those that follow another tied to the first in the chain, which follows none itself."""
        by_name = {joint.name: joint for joint in joints}
        return [replace(joint, mimic=self._first_leader(joint, by_name)) for joint in joints]

    def _first_leader(self, joint: Joint, joints: dict[str, Joint]) -> Mimic | None:
        mimic = joint.mimic
        if mimic is None:
            return None
        element = self.element_of(joint).find("mimic") or self.element_of(joint)
        if not joint.is_driven:
            self._problems.warn(element, f"a {joint.type} joint follows nothing; left out")
            return None
        way = {joint.name: None}
        while True:
            leader = joints.get(mimic.joint)
            if leader is None:
                hint = did_you_mean(mimic.joint, joints) if len(joints) <= _FEW else ""
                self._problems.error(element, f"follows the unknown joint {shortened(mimic.joint)!r}{hint}")
                return None
            if leader.name in way:
                self._problems.error(element, f"joints that follow each other in a ring: {', '.join(list(way)[:5])}")
                return None
            if not leader.is_driven:
                self._problems.error(element, f"follows {shortened(leader.name)!r}, a {leader.type} joint")
                return None
            if max(abs(mimic.multiplier), abs(mimic.offset)) > FARTHEST:
                self._problems.error(
                    element, f"follows {shortened(leader.name)!r} by a factor or offset beyond {FARTHEST:g}"
                )
                return None
            if leader.mimic is None:
                return mimic
            way[leader.name] = None
            further = leader.mimic
            offset = mimic.multiplier * further.offset + mimic.offset
            mimic = Mimic(further.joint, mimic.multiplier * further.multiplier, offset)
