"""Feedforward for soft servos: a command that leads by the predicted tracking error of the original's servos.

A servo with stiffness p and derivative gain d gives the force p x + d x' when its command is x ahead of the joint. The
planned motion determines the force that the joint needs: dry and viscous friction, weight, and on the rail the force
that accelerates the arm. The lead x is the response of the first-order filter 1 / (p + d s) to that force.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from cellwright.motion.joint_motion import JointMotion, knot_velocities
from cellwright.motion.joints import STILL, Joints, JointsLike
from cellwright.motion.kinematics import LENGTHS, link_poses
from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3

GRAVITY = 9.81
"""Gravitational acceleration of the cell [m/s^2]."""

_MASSES: Mapping[str, tuple[float, float]] = {
    "upper_arm_link": (12.93, LENGTHS.a2 / 2),
    "forearm_link": (3.87, LENGTHS.a3 / 2),
    "wrist_1_link": (1.96, 0.0),
    "wrist_2_link": (1.96, 0.0),
    "wrist_3_link": (0.202, 0.0),
    "vacuum_gripper_link": (0.01, 0.0),
}
"""Mass [kg] of each link that gravity acts on, and its centre along its z axis [m] (public robot description)."""

_AXES: tuple[tuple[str, Vector3], ...] = (
    ("upper_arm_link", (0.0, 1.0, 0.0)),
    ("forearm_link", (0.0, 1.0, 0.0)),
    ("wrist_1_link", (0.0, 1.0, 0.0)),
    ("wrist_2_link", (0.0, 0.0, 1.0)),
    ("wrist_3_link", (0.0, 1.0, 0.0)),
)
"""Axes of the joints that bear weight, shoulder lift to wrist 3, in the frame of the link that each moves."""

_STEP = 0.01
_SLOW = 0.01
"""Speed [m/s; rad/s] below which dry friction roughly grows with speed, so that it does not jump."""


@dataclass(frozen=True, slots=True)
class ServoModel:
    """Resistance of the joints, and the gains of their servos: one figure per joint.

    Attributes:
        stiffness: p [N/m for the rail; N m/rad].
        derivative: d [N s/m; N m s/rad].
        damping: viscous friction [N s/m; N m s/rad].
        friction: dry friction [N; N m]; in the cell's arm only if its file sets `arm.dry_friction`.
        inertia: moved inertia [kg; kg m^2]; 0 to neglect it.
    """

    stiffness: Joints
    derivative: Joints
    damping: Joints
    friction: Joints = STILL
    inertia: Joints = STILL


ORIGINAL_SERVO = ServoModel(
    stiffness=Joints(10000.0, 10000.0, 50000.0, 50000.0, 100.0, 75.0, 25.0),
    derivative=Joints(500.0, 150.0, 150.0, 150.0, 5.0, 2.0, 1.0),
    damping=Joints(20.0, 20.0, 20.0, 20.0, 1.0, 1.0, 0.5),
    inertia=Joints(32.7, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
)
"""Servos of the `original` profile: the published gains of the arm's controller and its joints' damping."""


def anticipated(motion: JointMotion, servo: ServoModel = ORIGINAL_SERVO, *, payload: float = 0.0) -> JointMotion:
    """Return a command with which the joints follow a motion that they would follow with a lag otherwise.

    The next motion must still begin at the end of this one (`motion.end`), not at the end of the command. The command
    continues for a short time after the motion, while the leads decay.

    Args:
        motion: motion of the joints, from rest to rest.
        servo: model of their servos.
        payload: mass that hangs on the gripper [kg].

    Raises:
        UsageError: the motion does not begin and end at rest.
    """
    if any(abs(v) > 1e-6 for v in (*motion.velocities[0], *motion.velocities[-1])):
        raise UsageError("motion must begin and end at rest")
    # After four time constants d / p of the slowest servo 2 % of a lead are left.
    fading = 4.0 * max(d / p for d, p in zip(servo.derivative, servo.stiffness, strict=True))
    duration = motion.duration + max(fading, 2 * _STEP)
    count = math.ceil(duration / _STEP)
    times = [duration * index / count for index in range(count + 1)]
    step = duration / count
    keeps = [
        math.exp(-step * p / d) if d > 0.0 else 0.0 for p, d in zip(servo.stiffness, servo.derivative, strict=True)
    ]
    force = weight(motion.start, payload)
    lead = Joints(*(f / p for f, p in zip(force, servo.stiffness, strict=True)))
    commands = [Joints(*(q + x for q, x in zip(motion.start, lead, strict=True)))]
    before = motion.at(0.0)
    for time in times[1:]:
        point = motion.at(time)
        push = [(b - a) / step for a, b in zip(before.velocities, point.velocities, strict=True)]
        held, dry, viscous = weight(point.positions, payload), servo.friction, servo.damping
        rows = zip(point.velocities, push, held, viscous, dry, servo.inertia, strict=True)
        needed = Joints(*(f * math.tanh(v / _SLOW) + c * v + m * a + w for v, a, w, c, f, m in rows))
        # Over a step the filter 1 / (p + d s) keeps exp(-step p / d) of its lead. The rest follows the mean force.
        rows = zip(lead, force, needed, servo.stiffness, keeps, strict=True)
        lead = Joints(*(keep * x + (1.0 - keep) * (f + g) / (2.0 * p) for x, f, g, p, keep in rows))
        commands.append(Joints(*(q + x for q, x in zip(point.positions, lead, strict=True))))
        force, before = needed, point
    rest = Joints(*(f / p for f, p in zip(weight(motion.end, payload), servo.stiffness, strict=True)))
    commands[-1] = Joints(*(q + x for q, x in zip(motion.end, rest, strict=True)))
    return JointMotion(tuple(times), tuple(commands), knot_velocities(times, commands, STILL, STILL))


def weight(joints: JointsLike, payload: float = 0.0) -> Joints:
    """Return each joint's torque [N m] against the weight it bears, `payload` [kg] included; 0 for rail and pan."""
    links = link_poses(joints)
    masses = [
        (mass + (payload if name == "vacuum_gripper_link" else 0.0), links[name].transform((0.0, 0.0, middle)))
        for name, (mass, middle) in _MASSES.items()
    ]
    torques = []
    for index, (link, direction) in enumerate(_AXES):
        ax, ay, _ = links[link].rotate(direction)
        ox, oy, _ = links[link].position
        # the axis times the lever times an upward force; wrist 1 and the links after it come after the first two links
        torques.append(GRAVITY * sum(mass * (ax * (y - oy) - ay * (x - ox)) for mass, (x, y, _) in masses[index:]))
    return Joints(0.0, 0.0, *torques)
