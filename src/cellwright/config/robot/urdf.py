"""Reads a robot from its URDF file: the tree of its joints, counted as PyBullet counts it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path

from cellwright.config.parsing.problems import Problem, Problems
from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import Joint, Link, RobotModel
from cellwright.config.robot.stand_ins import Use, with_stand_ins
from cellwright.config.robot.urdf_file import Element, read_elements, refusal
from cellwright.config.robot.urdf_joints import JointReader
from cellwright.config.robot.urdf_links import LinkReader
from cellwright.config.robot.urdf_numbers import Numbers
from cellwright.util.errors import DescriptionError, did_you_mean

MOST_LINKS = 1000
"""Most links of one robot."""
MOST_SHAPES = 5000
"""Most shapes of one robot, seen and touched together."""
MOST_WARNINGS = 20
"""Most warnings that are told of one file."""

_LONGEST_TAG = 60
_SHOWN = 3  # names that a message gives before it counts the rest
_OTHERS = {"sdf": "an SDF file", "mujoco": "MuJoCo's own format (MJCF)", "launch": "a launch file"}
_XACRO = "xacro:"
_EXPANDED = "; macros of xacro are expanded where the file's name ends in .xacro"
_KNOWN = ("link", "joint", "material")


def read_urdf(path: Path, *, warn: Callable[[str], None]) -> RobotModel:
    """The robot in a URDF or xacro file.

    Args:
        path: the file.
        warn: told what was forgiven or replaced, each as one line `path:line: key: what`.

    Raises:
        DescriptionError: it is none that can be read; every problem reads `path:line: key: what is wrong`.
    """
    problems = Problems()
    robot = _Reader(read_elements(path, problems), path, problems).read()
    if problems.errors or robot is None:
        raise DescriptionError(problems.errors, problems.warnings)
    warnings = problems.warnings
    for warning in warnings[:MOST_WARNINGS]:
        warn(str(warning))
    if len(warnings) > MOST_WARNINGS:
        warn(f"{path}: {len(warnings) - MOST_WARNINGS} more warnings like these")
    return robot


class _Reader:
    def __init__(self, root: Element, path: Path, problems: Problems) -> None:
        if root.tag != "robot":
            what = _OTHERS.get(root.tag, f"no robot: it begins with <{shortened(root.tag)}>")
            raise refusal(path, root.place.line, f"{what}; a URDF file begins with <robot>")
        self._root = root
        self._path = path
        self._problems = problems
        numbers = Numbers(problems)
        self._meshes = MeshFinder(path)
        self._links = LinkReader(numbers, self._meshes)
        self._joints = JointReader(numbers)

    def read(self) -> RobotModel | None:
        """The robot; None where something is wrong, which is among the problems then."""
        self._tell_of_others()
        self._check_counts()
        elements = self._link_elements()
        joints = self._connected(elements)
        roots = [name for name in elements if name not in {joint.child for joint in joints}]
        if self._problems.errors or not self._has_one_root(elements, roots):
            return None
        ordered = _counted(roots[0], joints)
        if len(ordered) < len(joints):
            reached = {joint.name for joint in ordered}
            ring = [joint.name for joint in joints if joint.name not in reached]
            element = self._joints.element_of(next(joint for joint in joints if joint.name == ring[0]))
            self._problems.error(element, f"joints that hang on each other in a ring: {_some(ring)}")
            return None
        self._links.read_materials(self._root)
        links = {name: self._links.read(element, name) for name, element in elements.items()}
        ordered = self._joints.with_leaders(ordered)
        links = self._with_stand_ins(links, ordered)
        self._tell_of_all()
        name = self._root.get("name") or self._path.stem
        written = tuple(joint.name for joint in joints)
        is_sorted = written == tuple(joint.name for joint in ordered)
        return RobotModel(name, roots[0], links, tuple(ordered), () if is_sorted else written)

    def _tell_of_others(self) -> None:
        """What is passed over, where it looks as if it was to be read: once for each kind."""
        first: dict[str, Element] = {}
        for element in self._root.children:
            first.setdefault(element.tag, element)
        for tag, element in islice(first.items(), MOST_LINKS):
            if tag.startswith(_XACRO):
                self._problems.warn(element, f"<{shortened(tag)}> is passed over{_EXPANDED}")
            elif tag not in _KNOWN and (hint := did_you_mean(tag[:_LONGEST_TAG], _KNOWN)):
                self._problems.warn(element, f"<{shortened(tag)}> is not read{hint}")

    def _check_counts(self) -> None:
        """Refuse what is no robot: all that follows takes its time with each link."""
        shapes = sum(len(link.all("visual", "collision")) for link in self._root.all("link"))
        for what, count, most in (
            ("links", len(self._root.all("link")), MOST_LINKS),
            ("joints", len(self._root.all("joint")), MOST_LINKS),
            ("shapes", shapes, MOST_SHAPES),
        ):
            if count > most:
                raise refusal(self._path, 0, f"{count} {what}; at most {most} are read")

    def _link_elements(self) -> dict[str, Element]:
        found: dict[str, Element] = {}
        for element in self._root.all("link"):
            name = element.get("name")
            if name is None:
                self._problems.error(element, "a link without a name")
            elif name in found:
                message = f"there is a link of this name already ({found[name].place}); names have to be unique"
                self._problems.error(element, message)
            else:
                found[name] = element
        if not found and not self._problems.errors:
            has_macros = any(element.tag.startswith(_XACRO) for element in self._root.children)
            self._problems.error(self._root, f"a robot without links{_EXPANDED if has_macros else ''}")
        return found

    def _connected(self, links: dict[str, Element]) -> list[Joint]:
        """The joints in the order of the file, each between links that there are."""
        found: list[Joint] = []
        above: dict[str, Joint] = {}
        for element in self._root.all("joint"):
            joint = self._joints.read(element)
            if joint is None:
                continue
            for tag, name in (("parent", joint.parent), ("child", joint.child)):
                if name not in links:
                    is_one_of_many = self._problems.error_count > MOST_WARNINGS  # names are searched slowly
                    hint = "" if is_one_of_many else did_you_mean(name[:_LONGEST_TAG], links)
                    self._problems.error(element.find(tag) or element, f"unknown link {shortened(name)!r}{hint}")
            if joint.child in above:
                message = (
                    f"{shortened(joint.child)!r} hangs on the joint {shortened(above[joint.child].name)!r} already"
                )
                self._problems.error(element, f"{message}; a link has one parent")
                continue
            above[joint.child] = joint
            found.append(joint)
        return found

    def _has_one_root(self, links: dict[str, Element], roots: list[str]) -> bool:
        if len(roots) == 1:
            return True
        if not roots:
            self._problems.error(self._root, "no first link: every link hangs on another, in a ring")
            return False
        message = f"{len(roots)} links hang on no joint ({_some(roots)}); all but one, the first, have to"
        self._problems.error(links[roots[1]], message)
        return False

    def _with_stand_ins(self, links: dict[str, Link], joints: list[Joint]) -> dict[str, Link]:
        """The links, with simple shapes where their meshes are missing, or where the file has no shapes at all.

        A robot without visuals is drawn by its collision shapes.
        """
        lacking = self._links.lacking
        shapes = [shape for link in links.values() for shape in link.shapes]
        if not lacking and not shapes:
            if joints and not self._problems.errors:
                self._warn("no shapes in the file; simple ones stand in")
            lacking = {name: {Use.SEEN, Use.TOUCHED} for name in links}
        elif not any(shape.is_seen for shape in shapes):
            bare = {name: {Use.SEEN} for name, link in links.items() if link.shapes}
            lacking = {name: lacking.get(name, set()) | bare.get(name, set()) for name in {**lacking, **bare}}
        return {name: with_stand_ins(link, joints, lacking.get(name, set())) for name, link in links.items()}

    def _tell_of_all(self) -> None:
        """One warning each for what may be the same in many places."""
        for what, names in (("velocity", self._joints.without_velocity), ("effort", self._joints.without_effort)):
            if names:
                count = "a joint has" if len(names) == 1 else f"{len(names)} joints have"
                message = f"{count} no {what} limit or one of 0 ({_some(names)}); taken for unlimited"
                self._warn(message)
        if names := self._links.without_inertia:
            count = "a link has" if len(names) == 1 else f"{len(names)} links have"
            self._warn(f"{count} an inertia that no body has, or none ({_some(names)}); a ball of water's is taken")
        if names := list(self._meshes.missing):
            count = "a mesh" if len(names) == 1 else f"{len(names)} meshes"
            links = len(self._links.lacking)
            where = f"in {links} link{'' if links == 1 else 's'}"
            reason = self._meshes.missing[names[0]]
            message = f"{count} {where} cannot be used, the first {shortened(names[0])!r}: {reason}"
            self._warn(f"{message}; simple shapes stand in")

    def _warn(self, message: str) -> None:
        self._problems.add(Problem(self._root.place, "", message, "warning"))


def _counted(root: str, joints: Iterable[Joint]) -> list[Joint]:
    """The joints below a link in the order of their indices: parents first, children in the order given."""
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


def _some(names: list[str]) -> str:
    shown = ", ".join(shortened(name) for name in names[:_SHOWN])
    return f"{shown}, and {len(names) - _SHOWN} more" if len(names) > _SHOWN else shown
