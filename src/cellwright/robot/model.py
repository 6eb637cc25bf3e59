"""Robot model of the engine: bodies, joints and masses of a URDF robot.

`servos.py` drives the joints. Defaults for what a URDF omits are those of the original io_teleop node. A link without
mass weighs 1 kg, and a link that a gripper drives 0.1 kg. (Measured: with these the QingLong follows its recorded
motion. Without them its wrists are four times too quick.)
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco

from cellwright.config.models.files import ModelFileError
from cellwright.config.parsing.tree import Place, Problem
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Link, position_of
from cellwright.mechanism.chain import JOINT_TYPES, add_chain, give_mass, inertia_along_link, range_of
from cellwright.mechanism.shapes import (
    ShapeBuilder,
    add_floor,
    exclude_contacts,
    joined_pairs,
    overlapping_pairs,
    pose_arguments,
    put_floor_under,
)
from cellwright.util.errors import DescriptionError

TIMESTEP = Fraction(1, 240)
"""Time step of the original's physics [s]."""
DEFAULT_MASS = 1.0
"""Mass of a link without one in the file [kg]; its inertia is that of a box around its shapes for contact."""
FINGER_MASS = 0.1
"""Mass of a link that a gripper's joint moves [kg]."""
_MIN_MASS, _MIN_INERTIA = 1e-6, 1e-9  # the engine takes no moving body without them
_Disable = mujoco.mjtDisableBit
BASE_BODY = "cellwright base"
"""Name of the body that carries the robot: it is not in the URDF, and `target_base_move` moves it."""


def body_of(link: str) -> str:
    """Return the name of a link's body in the engine: the link's own, except for names of the world and our bodies."""
    return f"cellwright link {link}" if link == "world" or link.startswith("cellwright ") else link


@dataclass(frozen=True)
class RobotWorld:
    """A robot and its engine model; joints and actuators have the names of joints, bodies those of `body_of`.

    The actuators exert nothing. Their controls hold the targets of the joints [rad; m], and so are part of the
    engine's state and can be moved in its own window.

    Attributes:
        config: the robot.
        model: the whole model, to be drawn.
        stepping: the same without what is only seen, which would cost in each step: bodies, joints and actuators have
            the same numbers.
    """

    config: RobotConfig
    model: mujoco.MjModel
    stepping: mujoco.MjModel

    def set_initial_posture(self, data: mujoco.MjData) -> None:
        """Write the initial posture.

        A joint that cannot be at 0 starts at the nearest limit. The original puts it at 0 all the same, and the first
        command makes it jump. Mimic joints start where they follow their leader.
        """
        robot, positions = self.config.robot, dict(self.config.start)
        leaders_first = sorted(robot.driven, key=lambda joint: joint.mimic is not None)
        for joint in leaders_first:
            if joint.name not in positions:
                place = position_of(robot, joint, positions)
                positions[joint.name] = min(max(place, joint.limits.lower), joint.limits.upper)
        for name, position in positions.items():
            data.qpos[self.model.joint(name).qposadr[0]] = position


def build_robot(config: RobotConfig, *, timestep: Fraction = TIMESTEP, self_collision: bool = False) -> RobotWorld:
    """Build a world with a robot in it and nothing else, without gravity, as in the original.

    Args:
        config: the robot.
        timestep: length of a step [s].
        self_collision: enables contacts between links, except for those that are joined or overlap in the initial
            posture.

    Raises:
        DescriptionError: the engine cannot build the robot.
    """
    with _report_refusal(config):
        whole, stepping = (_specify(config, timestep, self_collision, is_seen) for is_seen in (True, False))
        add_floor(whole)
        model = whole.compile()
    world, data = RobotWorld(config, model, model), mujoco.MjData(model)
    world.set_initial_posture(data)
    if overlapping := overlapping_pairs(model, data) if self_collision else []:
        exclude_contacts(whole, overlapping)
        exclude_contacts(stepping, overlapping)
        model = whole.compile()
    put_floor_under(model, data)
    return RobotWorld(config, model, stepping.compile())


def _specify(config: RobotConfig, timestep: Fraction, is_touched: bool, is_seen: bool) -> Any:  # noqa: FBT001
    """Return the specification of a robot's model, with shapes that are touched, seen or both."""
    spec = mujoco.MjSpec()
    spec.modelname = config.name
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia = _MIN_MASS, _MIN_INERTIA
    spec.compiler.balanceinertia = True
    option = spec.option
    option.timestep = float(timestep)
    option.gravity = (0.0, 0.0, 0.0)
    # Drives are constraints here: nothing needs damping.
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.tolerance = 1e-10
    # The actuators exert nothing, joints have neither springs nor damping, and links meet only if they are asked to.
    option.disableflags |= int(_Disable.mjDSBL_ACTUATION | _Disable.mjDSBL_SPRING | _Disable.mjDSBL_DAMPER)
    if not is_touched:
        option.disableflags |= int(_Disable.mjDSBL_CONTACT)
    # Two are usual; up to fifty when many drives reach their limits at once.
    option.iterations = 100
    builder = _RobotBuilder(spec, config, is_touched=is_touched, is_seen=is_seen)
    builder.build()
    moved = frozenset(joint.name for joint in config.robot.joints if joint.type in JOINT_TYPES)
    joined = joined_pairs(config.robot, moved, frozenset(builder.touched))
    exclude_contacts(spec, [(body_of(one), body_of(other)) for one, other in joined])
    return spec


@contextmanager
def _report_refusal(config: RobotConfig) -> Iterator[None]:
    """Report in one sentence why the engine refuses a robot, or why its meshes can no longer be read."""
    try:
        yield
    except (ValueError, ModelFileError) as error:
        message = f"the engine cannot build this robot: {' '.join(str(error).split())}"
        raise DescriptionError([Problem(Place(0, str(config.urdf_path), 0), "", message)]) from None


class _RobotBuilder:
    def __init__(self, spec: Any, config: RobotConfig, *, is_touched: bool, is_seen: bool) -> None:
        self._spec, self._config, self._robot = spec, config, config.robot
        self._shapes = ShapeBuilder(spec, is_touched=is_touched, is_seen=is_seen)
        self.touched: set[str] = set()
        """Links with shapes for contact."""
        self._fingers = {self._robot.joint(name).child for gripper in config.grippers for name in gripper.joints}

    def build(self) -> None:
        """Build the base with the robot on it, from the link that is fixed to the world."""
        base = self._spec.worldbody.add_body(name=BASE_BODY, mocap=True, **pose_arguments(self._config.base_pose))
        first = self._config.fixed_link or self._robot.root
        add_chain(base, self._robot, self._fill, first=first, body_of=body_of)
        for joint in self._robot.driven:
            actuator = self._spec.add_actuator(name=joint.name, target=joint.name)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.gainprm[0] = 0.0
            actuator.ctrllimited, actuator.ctrlrange = range_of(joint)

    def _fill(self, body: Any, link: Link) -> None:
        """Add mass and shapes of a link."""
        inertial = link.inertial
        mass = DEFAULT_MASS if inertial is None else inertial.mass
        inertia = self._inertia_of_shapes(link) if inertial is None else inertia_along_link(inertial)
        if link.name in self._fingers:
            factor = FINGER_MASS / mass if mass > 0 else 0.0
            mass, inertia = FINGER_MASS, tuple(factor * value for value in inertia)
        give_mass(body, mass, (0.0, 0.0, 0.0) if inertial is None else inertial.pose.position, inertia)
        for shape in link.shapes:
            if self._shapes.add(body, shape):
                self.touched.add(link.name)

    def _inertia_of_shapes(self, link: Link) -> tuple[float, ...]:
        """Return the inertia of a link without mass: of a 1 kg box around its shapes for contact, or almost 0."""
        x, y, z = self._shapes.extent(link.shapes)
        # A solid box has the inertia m / 12 (y^2 + z^2) about x, and so on; its products of inertia are 0.
        squares = (y * y + z * z, z * z + x * x, x * x + y * y)
        return (*(max(DEFAULT_MASS / 12 * square, _MIN_INERTIA) for square in squares), 0.0, 0.0, 0.0)
