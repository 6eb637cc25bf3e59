"""Robot model of the engine: a robot alone in its world, without gravity, as in the original."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco

from cellwright.config.models.files import ModelFileError
from cellwright.config.parsing.tree import Place, Problem
from cellwright.config.robot.config import RobotConfig, initial_posture
from cellwright.config.robot.model import Link
from cellwright.mechanism.chain import JOINT_TYPES
from cellwright.mechanism.robot_bodies import ITERATIONS, add_robot
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
        """Write the initial posture."""
        for name, position in initial_posture(self.config).items():
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
        whole, stepping = (
            _specify(config, timestep, is_touched=self_collision, is_seen=is_seen) for is_seen in (True, False)
        )
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


def build_links(config: RobotConfig) -> mujoco.MjModel:
    """Build the links and joints of a robot without shapes: enough for its kinematics.

    Raises:
        DescriptionError: the engine cannot build the robot.
    """
    with _report_refusal(config):
        return _specify(config, TIMESTEP, is_touched=False, is_seen=False).compile()


def _specify(config: RobotConfig, timestep: Fraction, *, is_touched: bool, is_seen: bool) -> Any:
    """Return the specification of a robot's model, with shapes that are touched, seen or both."""
    spec = mujoco.MjSpec()
    spec.modelname = config.name
    spec.compiler.degree = False
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
    option.iterations = ITERATIONS
    base = spec.worldbody.add_body(name=BASE_BODY, mocap=True, **pose_arguments(config.base_pose))
    shapes, touched = ShapeBuilder(spec, is_touched=is_touched, is_seen=is_seen), set()

    def fill(body: Any, link: Link) -> None:
        for shape in link.shapes:
            if shapes.add(body, shape):
                touched.add(link.name)

    add_robot(spec, base, config, fill, extent=shapes.extent, body_of=body_of)
    moved = frozenset(joint.name for joint in config.robot.joints if joint.type in JOINT_TYPES)
    joined = joined_pairs(config.robot, moved, frozenset(touched))
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
