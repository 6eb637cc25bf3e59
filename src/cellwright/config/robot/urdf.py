"""URDF reader: a robot as the tree of its joints, numbered as PyBullet numbers them."""

from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path

from cellwright.config.models.meshes import MAX_SIZE
from cellwright.config.models.xml import URDF_VERSIONS
from cellwright.config.parsing.tree import Problem, Problems, refusal, shortened
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import Joint, Link, RobotModel, in_index_order
from cellwright.config.robot.urdf_file import NO_ARGUMENTS, Arguments, Element, read_elements
from cellwright.config.robot.urdf_joints import JointReader
from cellwright.config.robot.urdf_links import LinkReader, Use, with_stand_ins
from cellwright.config.robot.urdf_numbers import Numbers
from cellwright.config.robot.urdf_vocabulary import warn_of_ignored
from cellwright.util.errors import DescriptionError, did_you_mean

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


def read_urdf(path: Path, *, warn: Callable[[str], None], arguments: Arguments = NO_ARGUMENTS) -> RobotModel:
    """Return the robot in a URDF or xacro file; `warn` gets a line `path:line: key: what` for each tolerated fault.

    Raises:
        DescriptionError: the file is no readable robot; every problem reads `path:line: key: what is wrong`.
    """
    problems = Problems()
    robot = _UrdfReader(read_elements(path, problems, arguments), path, problems).read()
    if problems.errors or robot is None:
        raise DescriptionError(problems.errors, problems.warnings)
    report_warnings(problems, path, warn)
    return robot


def report_warnings(problems: Problems, path: Path, warn: Callable[[str], None]) -> None:
    """Pass the warnings about a robot file to `warn`, and count those beyond the first ones."""
    warnings = problems.warnings
    for warning in warnings[:MAX_WARNINGS]:
        warn(str(warning))
    if len(warnings) > MAX_WARNINGS:
        warn(f"{path}: {len(warnings) - MAX_WARNINGS} more warnings are not listed")


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
        ordered = in_index_order(roots[0], joints)
        if len(ordered) < len(joints):
            reached = {joint.name for joint in ordered}
            ring = [joint.name for joint in joints if joint.name not in reached]
            element = self._joints.element_of(next(joint for joint in joints if joint.name == ring[0]))
            self._problems.error(element, f"joints form a loop: {abbreviated(ring)}")
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
                    # the search for similar names is slow
                    is_one_of_many = self._problems.error_count > MAX_WARNINGS
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
            f"a robot must have one root link (got {len(roots)}: {abbreviated(roots)}); connect the others by joints"
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
                message = f"{count} no {kind} limit, or 0 ({abbreviated(names)}); treated as unlimited"
                self._warn(message)
        if names := self._links.without_inertia:
            count = "a link has" if len(names) == 1 else f"{len(names)} links have"
            self._warn(
                f"{count} no valid inertia ({abbreviated(names)}); that of a water sphere of the same mass is used"
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


def abbreviated(names: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    shown = ", ".join(shortened(name) for name in names[:_MAX_SHOWN])
    return f"{shown}, and {len(names) - _MAX_SHOWN} more" if len(names) > _MAX_SHOWN else shown
