"""Drawing of the QingLong: shapes that every URDF reader supports, and the body and hands made of them.

The body is drawn with stretched arms (all joints at 0), in the frame of its torso: x points forward, y to the left, z
up. Only the right arm and leg are drawn; the left ones are their mirror image. Each link of a hand is drawn in its own
frame: in the palm z points to the fingers and y to the back of the hand; a finger closes about its x.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

from cellwright.config.models.model import ModelShapeKind
from cellwright.config.robot.model import RobotModel
from cellwright.util.pose import Pose, Vector3

SHELL, DARK, AZURE, GLASS, RUBBER = "shell", "graphite", "azure", "glass", "rubber"
COLOURS = {
    SHELL: (0.80, 0.81, 0.83, 1.0),
    DARK: (0.17, 0.18, 0.20, 1.0),
    AZURE: (0.05, 0.45, 0.80, 1.0),
    GLASS: (0.03, 0.04, 0.06, 1.0),
    RUBBER: (0.30, 0.31, 0.33, 1.0),
}
"""Red, green, blue, opacity in 0..1, by name."""

_FINGERS = ("ff", "mf", "rf", "lf")


@dataclass(frozen=True, slots=True)
class Shape:
    """Box, cylinder or sphere.

    Attributes:
        kind: the kind of shape.
        size: edge lengths [m] of a box; radius and length [m] of a cylinder, which lies along z; radius [m] of a
            sphere.
        pose: pose of its centre.
        colour: one of `COLOURS`; empty for a shape for collision only.
    """

    kind: ModelShapeKind
    size: Vector3
    pose: Pose
    colour: str

    def mirrored(self) -> Shape:
        """Return its mirror image in the plane y = 0."""
        (x, y, z), (roll, pitch, yaw) = self.pose.position, self.pose.rpy
        return replace(self, pose=Pose.from_rpy((x, -y, z), (-roll, pitch, -yaw)))

    def seen_from(self, frame: Pose) -> Shape:
        """Return it in another frame, whose pose is given in its present one."""
        return replace(self, pose=frame.inverse() @ self.pose)


def block(centre: Vector3, size: Vector3, colour: str, rpy: Vector3 = (0.0, 0.0, 0.0)) -> Shape:
    """Return a box with edges of `size` [m], turned by roll, pitch, yaw [rad]."""
    return Shape("box", size, Pose.from_rpy(centre, rpy), colour)


def ball(centre: Vector3, radius: float, colour: str) -> Shape:
    """Return a sphere; centre and radius in m."""
    return Shape("sphere", (radius, 0.0, 0.0), Pose(centre), colour)


def rod(start: Vector3, end: Vector3, radius: float, colour: str) -> Shape:
    """Return a cylinder from one point to another [m]."""
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    length = math.hypot(x, y, z)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2)
    turned = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))
    return Shape("cylinder", (radius, length, 0.0), Pose.from_rpy(middle, turned), colour)


def capsule(start: Vector3, end: Vector3, radius: float, colour: str) -> list[Shape]:
    """Return a rod with round ends, centred on `start` and `end` [m]."""
    return [rod(start, end, radius, colour), ball(start, radius, colour), ball(end, radius, colour)]


def cushion(centre: Vector3, size: Vector3, radius: float, colour: str) -> list[Shape]:
    """Return a box with round edges and corners; centre, edge lengths and radius in m."""
    x, y, z = centre
    inner = [length - 2 * radius for length in size]
    found = [
        block(centre, (size[0], inner[1], inner[2]), colour),
        block(centre, (inner[0], size[1], inner[2]), colour),
        block(centre, (inner[0], inner[1], size[2]), colour),
    ]
    a, b, c = (length / 2 for length in inner)
    for s, t in product((-1, 1), repeat=2):
        found.append(rod((x - a, y + s * b, z + t * c), (x + a, y + s * b, z + t * c), radius, colour))
        found.append(rod((x + s * a, y - b, z + t * c), (x + s * a, y + b, z + t * c), radius, colour))
        found.append(rod((x + s * a, y + t * b, z - c), (x + s * a, y + t * b, z + c), radius, colour))
    found.extend(ball((x + r * a, y + s * b, z + t * c), radius, colour) for r, s, t in product((-1, 1), repeat=3))
    return found


Drawing = Mapping[str, list[Shape]]
"""Shapes by link."""


def trunk() -> Drawing:
    """Return torso, head, waist and pelvis."""
    return {
        "base_link": [
            *cushion((-0.005, 0.0, 0.305), (0.20, 0.27, 0.24), 0.055, SHELL),
            *cushion((0.0, 0.0, 0.135), (0.15, 0.19, 0.20), 0.05, DARK),
            *cushion((-0.10, 0.0, 0.29), (0.09, 0.20, 0.22), 0.03, DARK),
            block((0.094, 0.0, 0.318), (0.012, 0.11, 0.012), AZURE),
            rod((0.088, 0.0, 0.26), (0.098, 0.0, 0.26), 0.022, AZURE),
            rod((0.088, 0.0, 0.26), (0.1, 0.0, 0.26), 0.016, DARK),
            rod((0.009, 0.0, 0.40), (0.009, 0.0, 0.432), 0.065, DARK),
            rod((0.004, -0.1616, 0.3922), (0.004, 0.1616, 0.3922), 0.052, DARK),
        ],
        "Link_head_yaw": [rod((0.009, 0.0, 0.43), (0.009, 0.0, 0.50), 0.042, DARK)],
        "Link_head_pitch": [
            *capsule((0.020, 0.0, 0.546), (0.010, 0.0, 0.614), 0.093, SHELL),
            *capsule((0.052, 0.0, 0.546), (0.046, 0.0, 0.606), 0.075, GLASS),
            block((0.1205, 0.0, 0.613), (0.004, 0.046, 0.006), AZURE),
            *(rod((0.012, 0.09 * s, 0.592), (0.012, 0.106 * s, 0.592), 0.036, DARK) for s in (-1, 1)),
            *(rod((0.012, 0.1 * s, 0.592), (0.012, 0.109 * s, 0.592), 0.026, AZURE) for s in (-1, 1)),
        ],
        "Link_waist_pitch": [rod((0.0, -0.066, 0.0), (0.0, 0.066, 0.0), 0.062, DARK)],
        "Link_waist_roll": [
            rod((-0.066, 0.0, 0.0), (0.064, 0.0, 0.0), 0.046, DARK),
            rod((-0.068, 0.0, 0.0), (0.066, 0.0, 0.0), 0.030, AZURE),
            rod((0.0035, 0.0, -0.098), (0.0035, 0.0, -0.03), 0.055, DARK),
        ],
        "Link_waist_yaw": [
            *cushion((-0.03, 0.0, -0.150), (0.15, 0.19, 0.105), 0.04, SHELL),
            rod((-0.084, -0.135, -0.167), (-0.084, 0.135, -0.167), 0.042, DARK),
        ],
    }


def right_arm() -> Drawing:
    """Return the right arm up to the wrist, stretched out to the side."""
    x, z = 0.004, 0.3922

    def at(y: float, forward: float = 0.0, up: float = 0.0) -> Vector3:
        return (x + forward, y, z + up)

    return {
        "Link_arm_r_01": [rod(at(-0.158), at(-0.20), 0.056, DARK)],
        "Link_arm_r_02": [
            ball(at(-0.2026), 0.064, SHELL),
            rod(at(-0.2026, -0.068), at(-0.2026, 0.068), 0.036, DARK),
            rod(at(-0.2026, -0.070), at(-0.2026, 0.070), 0.020, AZURE),
            rod(at(-0.2026), at(-0.322), 0.045, SHELL),
        ],
        "Link_arm_r_03": [
            rod(at(-0.322), at(-0.334), 0.043, AZURE),
            rod(at(-0.334), at(-0.44), 0.045, SHELL),
            *capsule(at(-0.44), at(-0.48, 0.0, 0.012), 0.0435, SHELL),
            rod(at(-0.5026, -0.052, 0.024), at(-0.5026, 0.052, 0.024), 0.040, DARK),
            rod(at(-0.5026, -0.054, 0.024), at(-0.5026, 0.054, 0.024), 0.022, AZURE),
        ],
        "Link_arm_r_04": [
            *capsule(at(-0.5026, 0.0, 0.024), at(-0.555, 0.0, 0.010), 0.041, SHELL),
            rod(at(-0.555, 0.0, 0.010), at(-0.604), 0.038, SHELL),
        ],
        "Link_arm_r_05": [
            rod(at(-0.604), at(-0.614), 0.036, AZURE),
            rod(at(-0.614), at(-0.70), 0.038, SHELL),
            ball(at(-0.70), 0.038, SHELL),
            *capsule(at(-0.70), at(-0.748), 0.031, SHELL),
            rod(at(-0.75), at(-0.785), 0.026, DARK),
        ],
        "Link_arm_r_06": [*capsule(at(-0.8026, 0.0, 0.002), at(-0.8026, 0.02, 0.014), 0.026, DARK)],
        "Link_arm_r_07": [
            rod(at(-0.8026, 0.01, -0.028), at(-0.8026, 0.01, 0.032), 0.021, RUBBER),
            rod(at(-0.806, 0.002), at(-0.862, -0.003), 0.024, DARK),
            rod(at(-0.862, -0.003), at(-0.873, -0.003), 0.030, RUBBER),
        ],
    }


def right_leg() -> Drawing:
    """Return the right leg."""
    y = -0.0955
    return {
        "Link_hip_r_roll": [
            rod((-0.09, -0.121, -0.167), (0.05, -0.121, -0.167), 0.050, DARK),
            rod((0.05, -0.121, -0.167), (0.056, -0.121, -0.167), 0.034, AZURE),
        ],
        "Link_hip_r_yaw": [rod((-0.002, -0.121, -0.215), (-0.002, -0.121, -0.30), 0.052, RUBBER)],
        "Link_hip_r_pitch": [
            rod((-0.002, -0.06, -0.2825), (-0.002, -0.182, -0.2825), 0.064, DARK),
            rod((-0.002, -0.180, -0.2825), (-0.002, -0.186, -0.2825), 0.040, AZURE),
            *capsule((-0.002, -0.116, -0.335), (0.002, -0.108, -0.49), 0.067, SHELL),
            *capsule((0.002, -0.108, -0.49), (0.003, y, -0.632), 0.056, SHELL),
        ],
        "Link_knee_r_pitch": [
            rod((-0.002, y - 0.062, -0.6825), (-0.002, y + 0.062, -0.6825), 0.052, DARK),
            rod((-0.002, y - 0.066, -0.6825), (-0.002, y + 0.066, -0.6825), 0.030, AZURE),
            *capsule((0.004, y, -0.752), (0.002, y, -0.86), 0.052, SHELL),
            *capsule((0.002, y, -0.86), (0.0, y, -1.005), 0.039, SHELL),
            *capsule((-0.018, y, -0.78), (-0.016, y, -0.86), 0.043, DARK),
        ],
        "Link_ankle_r_pitch": [rod((-0.002, y - 0.044, -1.0695), (-0.002, y + 0.044, -1.0695), 0.028, DARK)],
        "Link_ankle_r_roll": [
            rod((-0.035, y, -1.0695), (0.03, y, -1.0695), 0.022, RUBBER),
            *capsule((-0.045, y, -1.113), (0.03, y, -1.113), 0.036, SHELL),
            *capsule((0.03, y, -1.113), (0.095, y, -1.122), 0.030, SHELL),
            block((0.035, y, -1.128), (0.17, 0.086, 0.024), SHELL),
            block((0.035, y, -1.144), (0.17, 0.092, 0.012), RUBBER),
            *(rod((x, y, -1.150), (x, y, -1.138), 0.046, RUBBER) for x in (-0.05, 0.12)),
            *(rod((x, y, -1.138), (x, y, -1.116), 0.043, SHELL) for x in (-0.05, 0.12)),
        ],
    }


def right_solids() -> Drawing:
    """Return collision shapes of the right arm and leg: coarse, a shape or two for each link."""
    x, z, y = 0.004, 0.3922, -0.0955
    return {
        "Link_arm_r_02": [rod((x, -0.225, z), (x, -0.315, z), 0.045, "")],
        "Link_arm_r_03": [rod((x, -0.34, z), (x, -0.46, z), 0.045, "")],
        "Link_arm_r_04": [rod((x, -0.52, z), (x, -0.60, z), 0.040, "")],
        "Link_arm_r_05": [rod((x, -0.63, z), (x, -0.775, z), 0.036, "")],
        "Link_hip_r_pitch": [rod((x, -0.11, -0.36), (x, y, -0.62), 0.065, "")],
        "Link_knee_r_pitch": [rod((0.0, y, -0.74), (0.0, y, -1.02), 0.05, "")],
        "Link_ankle_r_roll": [block((0.035, y, -1.125), (0.25, 0.092, 0.05), "")],
    }


def trunk_solids() -> Drawing:
    """Return collision shapes of torso, head and pelvis."""
    return {
        "base_link": [block((-0.02, 0.0, 0.24), (0.22, 0.26, 0.36), "")],
        "Link_head_pitch": [ball((0.02, 0.0, 0.58), 0.11, "")],
        "Link_waist_yaw": [block((-0.03, 0.0, -0.155), (0.15, 0.19, 0.10), "")],
    }


def hand(robot: RobotModel, side: str) -> dict[str, list[Shape]]:
    """Return the visual shapes of a hand, by link.

    Args:
        robot: gives the lengths.
        side: `rh` or `lh`.
    """
    out = 1.0 if side == "rh" else -1.0  # direction of the index finger and the thumb
    drawn: dict[str, list[Shape]] = {
        f"{side}_palm": [
            block((0.0, -0.002, 0.046), (0.070, 0.022, 0.080), DARK),
            block((0.0, 0.008, 0.050), (0.064, 0.016, 0.070), SHELL),
            block((0.0, 0.0165, 0.052), (0.030, 0.002, 0.018), AZURE),
            *(rod((s * 0.035, -0.002, 0.008), (s * 0.035, -0.002, 0.084), 0.011, DARK) for s in (-1, 1)),
            rod((-0.034, -0.002, 0.006), (0.034, -0.002, 0.006), 0.011, DARK),
            rod((0.0, 0.0, -0.006), (0.0, 0.0, 0.01), 0.027, RUBBER),
            *capsule((out * 0.022, -0.012, 0.012), (out * 0.034, -0.0086, 0.029), 0.012, DARK),
        ],
        f"{side}_lfmetacarpal": [*capsule((0.0, 0.0, 0.0), (out * 0.046, 0.0, 0.032), 0.009, DARK)],
        f"{side}_thbase": [ball((0.0, 0.0, 0.0), 0.0125, DARK)],
        f"{side}_thproximal": _bone(robot, f"{side}_THJ3", 0.0108),
        f"{side}_thhub": [ball((0.0, 0.0, 0.0), 0.0108, DARK)],
        f"{side}_thmiddle": _bone(robot, f"{side}_THJ1", 0.0098),
        f"{side}_thdistal": _finger_end(robot, f"{side}_thtip", 0.0092),
    }
    for finger in _FINGERS:
        upper = f"{side}_{finger.upper()}"
        drawn[f"{side}_{finger}knuckle"] = [rod((-0.0098, 0.0, 0.0), (0.0098, 0.0, 0.0), 0.0105, DARK)]
        drawn[f"{side}_{finger}proximal"] = _bone(robot, f"{upper}J2", 0.0092)
        drawn[f"{side}_{finger}middle"] = _bone(robot, f"{upper}J1", 0.0084)
        drawn[f"{side}_{finger}distal"] = _finger_end(robot, f"{upper}tip", 0.0078)
    return drawn


def hand_solids(robot: RobotModel, side: str) -> dict[str, list[Shape]]:
    """Return the collision shapes of a hand, by link."""
    touched = {f"{side}_palm": [block((0.0, 0.0, 0.045), (0.056, 0.022, 0.075), "")]}
    for finger in _FINGERS:
        upper = f"{side}_{finger.upper()}"
        for part, joint in (("proximal", f"{upper}J2"), ("middle", f"{upper}J1"), ("distal", f"{upper}tip")):
            touched[f"{side}_{finger}{part}"] = [_core(robot, joint, 0.007)]
    for part, joint in (("proximal", "THJ3"), ("middle", "THJ1"), ("distal", "thtip")):
        touched[f"{side}_th{part}"] = [_core(robot, f"{side}_{joint}", 0.008)]
    return touched


def _length(robot: RobotModel, joint: str) -> float:
    """Return the distance of a joint along the finger from the one before it [m]."""
    return robot.joint(joint).origin.position[2]


def _bone(robot: RobotModel, next_joint: str, radius: float) -> list[Shape]:
    length = _length(robot, next_joint)
    return [
        rod((0.0, 0.0, 0.004), (0.0, 0.0, length - 0.005), radius, SHELL),
        rod((-radius, 0.0, length), (radius, 0.0, length), 0.9 * radius, DARK),
    ]


def _finger_end(robot: RobotModel, tip: str, radius: float) -> list[Shape]:
    length = _length(robot, tip)
    return [
        rod((0.0, 0.0, 0.004), (0.0, 0.0, 0.45 * length), radius, SHELL),
        rod((0.0, 0.0, 0.45 * length), (0.0, 0.0, length - radius), radius, RUBBER),
        ball((0.0, 0.0, length - radius), radius, RUBBER),
    ]


def _core(robot: RobotModel, next_joint: str, radius: float) -> Shape:
    length = _length(robot, next_joint)
    return rod((0.0, 0.0, 0.2 * length), (0.0, 0.0, 0.85 * length), radius, "")
