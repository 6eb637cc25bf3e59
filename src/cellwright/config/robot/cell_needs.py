"""Facts that an arm in a cell needs and that its description may lack: limits of joints, and masses.

The robot face does without: there a drive reaches its target whatever it takes. In a cell forces count, and a made-up
one would decide what an arm can hold.
"""

import math
from collections.abc import Collection, Iterator
from pathlib import Path

from cellwright.config.parsing.tree import Definition, Place, Problem, shortened
from cellwright.config.robot.model import Joint, JointType, Link, RobotModel


def missing_for_cell(robot: RobotModel, path: Path, joints: Collection[str] | None = None) -> tuple[Problem, ...]:
    """Return what a cell's arm needs and its description lacks, in the order of the joints.

    These are an effort limit and a velocity limit of each driven joint, a range of each revolute or prismatic one, and
    a mass of what each joint moves: its link, or the links that are fixed to it. Joints that follow others need a mass
    alone.

    Args:
        robot: the robot, with the limits that the arm's entry gives in place of the file's.
        path: its file, for links and joints that do not know their place.
        joints: names of the joints that belong to the arm; by default all.

    Example:
        >>> joint = Joint("elbow", JointType.REVOLUTE, "base", "forearm")
        >>> robot = RobotModel("arm", "base", {"base": Link("base"), "forearm": Link("forearm")}, (joint,))
        >>> for problem in missing_for_cell(robot, Path("arm.urdf")):
        ...     print(problem.message.partition(";")[0])
        the joint has no range
        the joint has no effort limit, or 0
        the joint has no velocity limit, or 0
        what joint 'elbow' moves has no mass
    """
    chosen = [joint for joint in robot.driven if joints is None or joint.name in joints]
    return tuple(problem for joint in chosen for problem in _missing(robot, joint, path))


def _missing(robot: RobotModel, joint: Joint, path: Path) -> Iterator[Problem]:
    """Yield what a driven joint lacks."""
    limits = joint.limits
    if joint.mimic is None:
        is_bounded = math.isfinite(limits.lower) and math.isfinite(limits.upper)
        if joint.type is not JointType.CONTINUOUS and not is_bounded:
            unit = "m" if joint.type is JointType.PRISMATIC else "rad"
            yield _problem(joint, path, f"the joint has no range; {_remedy(joint, 'lower', 'upper')} [{unit}]")
        units = ("N", "m/s") if joint.type is JointType.PRISMATIC else ("N m", "rad/s")
        for name, value, unit in zip(("effort", "velocity"), (limits.effort, limits.velocity), units, strict=True):
            if not 0 < value < math.inf:
                yield _problem(joint, path, f"the joint has no {name} limit, or 0; {_remedy(joint, name)} [{unit}]")
    if not any(link.inertial is not None and link.inertial.mass > 0 for link in _moved_together(robot, joint.child)):
        message = f"what joint {shortened(joint.name)!r} moves has no mass; write <inertial> with its mass [kg]"
        yield _problem(robot.links[joint.child], path, message)


def _remedy(joint: Joint, *names: str) -> str:
    """Return what to write, in the file or in the arm's entry."""
    attributes = " and ".join(f'{name}="…"' for name in names)
    entries = ", ".join(f"{name}: …" for name in names)
    written = f"{{{shortened(joint.name)}: {{{entries}}}}}"
    return f"write {attributes} in its <limit>, or `limits: {written}` in the arm's entry"


def _moved_together(robot: RobotModel, link: str) -> Iterator[Link]:
    """Yield a link, and those that joints without motion fix to it."""
    fixed = {link}
    yield robot.links[link]
    # parents come before children
    for joint in robot.joints:
        if joint.parent in fixed and joint.type is JointType.FIXED:
            fixed.add(joint.child)
            yield robot.links[joint.child]


def _problem(owner: Joint | Link, path: Path, message: str) -> Problem:
    kind = "joint" if isinstance(owner, Joint) else "link"
    place = owner.definition or Definition(Place(0, str(path), 0), f"{kind}[{owner.name}]")
    return Problem(place.place, place.key, message)
