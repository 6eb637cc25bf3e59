"""URDF reader: a robot as the tree of its joints, numbered as PyBullet numbers them."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

from cellwright.config.models.meshes import MAX_SIZE
from cellwright.config.models.xml import URDF_VERSIONS
from cellwright.config.parsing.tree import Problem, Problems, refusal, shortened
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import Joint, JointType, Limits, Link, Mimic, RobotModel
from cellwright.config.robot.urdf_file import NO_ARGUMENTS, Arguments, Element, read_elements
from cellwright.config.robot.urdf_links import LinkReader, Use, with_stand_ins
from cellwright.config.robot.urdf_numbers import MAX_COORDINATE, Numbers
from cellwright.config.robot.urdf_vocabulary import warn_of_ignored
from cellwright.util.errors import DescriptionError, did_you_mean, suggestion
from cellwright.util.pose import Vector3

UNLIMITED = 1e9
"""Figures from here on mean no limit [rad; m; N m; N; rad/s; m/s]."""

_AXIS_TOLERANCE = 1e-3  # tolerance of an axis's length, for rounding
_CUT_SHARE = 0.01  # share of a follower's range that its own limits may cut off unreported, for rounding
_MAX_SUGGESTION_JOINTS = 200  # number of joints up to which similar names are searched, which is slow
_NO_AXIS = (0.0, 0.0, 0.0)
MAX_LINKS = 1000
"""Maximum number of links of one robot."""
MAX_SHAPES = 5000
"""Maximum number of shapes of one robot, visual and collision shapes together."""
MAX_WARNINGS = 20
"""Maximum number of warnings that are listed for one file."""
_MAX_TAG_LENGTH = 60
_MAX_SHOWN = 3  # number of names in a message before it counts the rest
_OTHERS = {"sdf": "an SDF file", "mujoco": "an MJCF file", "launch": "a launch file"}
_XACRO = "xacro:"
_EXPANDED = "; xacro is expanded only in files whose name ends in .xacro"


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
        return Joint(name, type_, parent, child, origin, axis, self._limits(element, type_), self._mimic(element))

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


def read_urdf(path: Path, *, warn: Callable[[str], None], arguments: Arguments = NO_ARGUMENTS) -> RobotModel:
    """Return the robot in a URDF or xacro file; `warn` gets a line `path:line: key: what` for each tolerated fault.

    Raises:
        DescriptionError: the file is no readable robot; every problem reads `path:line: key: what is wrong`.
    """
    problems = Problems()
    robot = _UrdfReader(read_elements(path, problems, arguments), path, problems).read()
    if problems.errors or robot is None:
        raise DescriptionError(problems.errors, problems.warnings)
    warnings = problems.warnings
    for warning in warnings[:MAX_WARNINGS]:
        warn(str(warning))
    if len(warnings) > MAX_WARNINGS:
        warn(f"{path}: {len(warnings) - MAX_WARNINGS} more warnings are not listed")
    return robot


class _UrdfReader:
    def __init__(self, root: Element, path: Path, problems: Problems) -> None:
        if root.tag != "robot":
            content = f", {_OTHERS[root.tag]}" if root.tag in _OTHERS else ""
            message = f"the root element of a URDF must be <robot> (got <{shortened(root.tag)}>{content})"
            raise refusal(path, root.place.line, message)
        self._root = root
        self._path = path
        self._problems = problems
        numbers = Numbers(problems)
        self._meshes = MeshFinder(path)
        self._links = LinkReader(numbers, self._meshes)
        self._joints = JointReader(numbers)

    def read(self) -> RobotModel | None:
        """Return the robot, or None after errors, which are in `problems`."""
        self._check_version()
        self._warn_of_macros()
        warn_of_ignored(self._root, self._problems)
        self._check_counts()
        elements = self._link_elements()
        joints = self._tree_joints(elements)
        roots = [name for name in elements if name not in {joint.child for joint in joints}]
        if self._problems.errors or not self._has_one_root(elements, roots):
            return None
        ordered = _in_index_order(roots[0], joints)
        if len(ordered) < len(joints):
            reached = {joint.name for joint in ordered}
            ring = [joint.name for joint in joints if joint.name not in reached]
            element = self._joints.element_of(next(joint for joint in joints if joint.name == ring[0]))
            self._problems.error(element, f"joints form a loop: {_abbreviated(ring)}")
            return None
        self._links.read_materials(self._root)
        links = {name: self._links.read(element, name) for name, element in elements.items()}
        ordered = self._joints.with_resolved_mimics(ordered)
        links = self._with_stand_ins(links, ordered)
        self._warn_of_repeated_faults()
        name = self._root.get("name") or self._path.stem
        written = tuple(joint.name for joint in joints)
        is_sorted = written == tuple(joint.name for joint in ordered)
        return RobotModel(name, roots[0], links, tuple(ordered), () if is_sorted else written)

    def _warn_of_macros(self) -> None:
        """Warn of macros in a file that is no xacro, once for each."""
        first: dict[str, Element] = {}
        for element in self._root.children:
            if element.tag.startswith(_XACRO):
                first.setdefault(element.tag, element)
        for tag, element in islice(first.items(), MAX_LINKS):
            self._problems.warn(element, f"<{shortened(tag)}> is ignored{_EXPANDED}")

    def _check_version(self) -> None:
        """Refuse a version of URDF with unknown content."""
        version = self._root.get("version")
        if version is not None and version not in URDF_VERSIONS:
            message = f"unknown version {shortened(version)!r} of URDF (known: {', '.join(URDF_VERSIONS)})"
            self._problems.error(self._root, message)

    def _check_counts(self) -> None:
        """Refuse excessive counts, since all following steps take time for each link."""
        shapes = sum(len(link.all("visual", "collision")) for link in self._root.all("link"))
        for kind, count, limit in (
            ("links", len(self._root.all("link")), MAX_LINKS),
            ("joints", len(self._root.all("joint")), MAX_LINKS),
            ("shapes", shapes, MAX_SHAPES),
        ):
            if count > limit:
                raise refusal(self._path, 0, f"too many {kind} (got {count}, at most {limit})")

    def _link_elements(self) -> dict[str, Element]:
        found: dict[str, Element] = {}
        for element in self._root.all("link"):
            name = element.get("name")
            if name is None:
                self._problems.error(element, "the link has no name")
            elif name in found:
                message = f"duplicate link name (first at {found[name].place}); choose another"
                self._problems.error(element, message)
            else:
                found[name] = element
        if not found and not self._problems.errors:
            has_macros = any(element.tag.startswith(_XACRO) for element in self._root.children)
            self._problems.error(self._root, f"the robot has no links{_EXPANDED if has_macros else ''}")
        return found

    def _tree_joints(self, links: dict[str, Element]) -> list[Joint]:
        """Return the joints in the order of the file, each between existing links."""
        found: list[Joint] = []
        above: dict[str, Joint] = {}
        for element in self._root.all("joint"):
            joint = self._joints.read(element)
            if joint is None:
                continue
            for tag, name in (("parent", joint.parent), ("child", joint.child)):
                if name not in links:
                    is_one_of_many = self._problems.error_count > MAX_WARNINGS  # the search for similar names is slow
                    hint = "" if is_one_of_many else did_you_mean(name[:_MAX_TAG_LENGTH], links)
                    self._problems.error(element.find(tag) or element, f"unknown link {shortened(name)!r}{hint}")
            if joint.child in above:
                message = (
                    f"{shortened(joint.child)!r} is already the child of joint {shortened(above[joint.child].name)!r}"
                )
                self._problems.error(element, f"{message}; a link can have only one parent")
                continue
            above[joint.child] = joint
            found.append(joint)
        return found

    def _has_one_root(self, links: dict[str, Element], roots: list[str]) -> bool:
        if len(roots) == 1:
            return True
        if not roots:
            self._problems.error(self._root, "no root link: every link is the child of another, in a loop")
            return False
        message = (
            f"a robot must have one root link (got {len(roots)}: {_abbreviated(roots)}); connect the others by joints"
        )
        self._problems.error(links[roots[1]], message)
        return False

    def _with_stand_ins(self, links: dict[str, Link], joints: list[Joint]) -> dict[str, Link]:
        """Return the links, with simple shapes where their meshes are missing, or where the file has no shapes at all.

        A robot without visuals is drawn by its collision shapes.
        """
        missing_uses = self._links.missing_uses
        shapes = [shape for link in links.values() for shape in link.shapes]
        if not missing_uses and not shapes:
            if joints and not self._problems.errors:
                self._warn("no shapes in the file; simple shapes are used")
            missing_uses = {name: {Use.SEEN, Use.TOUCHED} for name in links}
        elif not any(shape.is_seen for shape in shapes):
            bare = {name: {Use.SEEN} for name, link in links.items() if link.shapes}
            missing_uses = {
                name: missing_uses.get(name, set()) | bare.get(name, set()) for name in {**missing_uses, **bare}
            }
        return {name: with_stand_ins(link, joints, missing_uses.get(name, set())) for name, link in links.items()}

    def _warn_of_repeated_faults(self) -> None:
        """Give one warning for each fault that may occur in many places."""
        for kind, names in (("velocity", self._joints.without_velocity), ("effort", self._joints.without_effort)):
            if names:
                count = "a joint has" if len(names) == 1 else f"{len(names)} joints have"
                message = f"{count} no {kind} limit, or 0 ({_abbreviated(names)}); treated as unlimited"
                self._warn(message)
        if names := self._links.without_inertia:
            count = "a link has" if len(names) == 1 else f"{len(names)} links have"
            self._warn(
                f"{count} no valid inertia ({_abbreviated(names)}); that of a water sphere of the same mass is used"
            )
        if names := list(self._meshes.missing):
            count = "a mesh" if len(names) == 1 else f"{len(names)} meshes"
            links = len(self._links.missing_uses)
            where = f"in {links} link{'' if links == 1 else 's'}"
            reason = self._meshes.missing[names[0]]
            message = f"{count} {where} cannot be used, the first {shortened(names[0])!r}: {reason}"
            self._warn(f"{message}; simple shapes are used")
        if lengths := self._meshes.oversized:
            first, length = next(iter(lengths.items()))
            count = "a mesh is" if len(lengths) == 1 else f"{len(lengths)} meshes are"
            message = f"{count} longer than {MAX_SIZE:g} m, the first {shortened(first)!r} with {length:.4g} m"
            self._warn(f'{message}; for a mesh in millimetres write scale="0.001 0.001 0.001"')

    def _warn(self, message: str) -> None:
        self._problems.add(Problem(self._root.place, "", message, "warning"))


def _in_index_order(root: str, joints: Iterable[Joint]) -> list[Joint]:
    """Return the joints below a link in the order of their indices: parents first, children in the order given."""
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    found: list[Joint] = []
    ahead = list(reversed(below.get(root, ())))
    while ahead:
        joint = ahead.pop()
        found.append(joint)
        ahead.extend(reversed(below.get(joint.child, ())))
    return found


def _abbreviated(names: list[str]) -> str:
    shown = ", ".join(shortened(name) for name in names[:_MAX_SHOWN])
    return f"{shown}, and {len(names) - _MAX_SHOWN} more" if len(names) > _MAX_SHOWN else shown
