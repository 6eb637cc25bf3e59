"""Robots of the robot face in the engine: the bodies of their links, and dry friction as the drives of their joints.

`robot/servos.py` moves the joints. Defaults for what a URDF omits are those of the original io_teleop node. A link
without mass weighs 1 kg, and a link that a gripper drives 0.1 kg. (Measured: with these the QingLong follows its
recorded motion. Without them its wrists are four times too quick.)
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import mujoco

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Link
from cellwright.mechanism.chain import Fill, add_chain, give_mass, inertia_along_link, range_of

UNLIMITED = 1e9
"""Effort limit [N m; N] of a joint without one in the URDF, and of a joint without a drive, which does not move."""
ITERATIONS = 100
"""Iterations of the engine's solver: two are usual, up to fifty when many drives reach their limits at once."""
DEFAULT_MASS = 1.0
"""Mass of a link without one in the file [kg]; its inertia is that of a box around its shapes for contact."""
FINGER_MASS = 0.1
"""Mass of a link that a gripper's joint moves [kg]."""
_MIN_MASS, _MIN_INERTIA = 1e-6, 1e-9  # the engine takes no moving body without them
_STIFFNESS = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""`solimp` of the drives: one step leaves 1e-4 of an error."""


def add_robot(
    spec: Any,
    base: Any,
    config: RobotConfig,
    fill: Fill,
    *,
    extent: Callable[[Iterable[ModelShape]], Sequence[float]],
    prefix: str = "",
    body_of: Callable[[str], str] = str,
) -> None:
    """Add a robot to a model specification, from the link that is fixed to its base, with an actuator for each joint.

    The actuators exert nothing. Their controls hold the targets of the joints [rad; m], and so are part of the engine's
    state. Until servos move them, drives hold their joints with at most the effort of the file.

    Args:
        spec: model specification.
        base: body of the specification that carries the robot.
        config: the robot.
        fill: gives each body the shapes of its link.
        extent: returns the edges [m] of the box around shapes for contact, along the axes of their link.
        prefix: prefix of all names in the engine.
        body_of: name of the body of a link, by the link's name with the prefix.
    """
    robot = config.robot.prefixed(prefix)
    fingers = {robot.joint(f"{prefix}{name}").child for gripper in config.grippers for name in gripper.joints}

    def fill_link(body: Any, link: Link) -> None:
        _give_mass(body, link, extent, is_finger=link.name in fingers)
        fill(body, link)

    spec.compiler.boundmass, spec.compiler.boundinertia, spec.compiler.balanceinertia = _MIN_MASS, _MIN_INERTIA, True
    first = f"{prefix}{config.fixed_link}" if config.fixed_link else robot.root
    made = add_chain(base, robot, fill_link, first=first, body_of=body_of)
    for name, joint in made.items():
        effort = robot.joint(name).limits.effort if robot.joint(name).is_driven else UNLIMITED
        joint.frictionloss = effort if math.isfinite(effort) else UNLIMITED
        joint.solimp_friction = _STIFFNESS
    for driven in robot.driven:
        actuator = spec.add_actuator(name=driven.name, target=driven.name)
        actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
        actuator.gainprm[0] = 0.0
        actuator.ctrllimited, actuator.ctrlrange = range_of(driven)


def _give_mass(
    body: Any, link: Link, extent: Callable[[Iterable[ModelShape]], Sequence[float]], *, is_finger: bool
) -> None:
    inertial = link.inertial
    mass = DEFAULT_MASS if inertial is None else inertial.mass
    inertia = _inertia_of_box(*extent(link.shapes)) if inertial is None else inertia_along_link(inertial)
    if is_finger:
        factor = FINGER_MASS / mass if mass > 0 else 0.0
        mass, inertia = FINGER_MASS, tuple(factor * value for value in inertia)
    give_mass(body, mass, (0.0, 0.0, 0.0) if inertial is None else inertial.pose.position, inertia)


def _inertia_of_box(x: float, y: float, z: float) -> tuple[float, ...]:
    """Return the inertia of a link without mass: of a 1 kg box around its shapes for contact, or almost 0."""
    # A solid box has the inertia m / 12 (y^2 + z^2) about x, and so on; its products of inertia are 0.
    squares = (y * y + z * z, z * z + x * x, x * x + y * y)
    return (*(max(DEFAULT_MASS / 12 * square, _MIN_INERTIA) for square in squares), 0.0, 0.0, 0.0)
