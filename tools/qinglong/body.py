"""The body of the QingLong, drawn as it stands with stretched arms (all joints at 0), in the frame of its torso.

x points forward, y to the left, z up. Of arms and legs the right ones are drawn; the left ones are their mirror image.
"""

from __future__ import annotations

from collections.abc import Mapping

from cellwright.util.pose import Vector3
from tools.qinglong.shapes import AZURE, DARK, GLASS, RUBBER, SHELL, Shape, ball, block, capsule, cushion, rod

Drawing = Mapping[str, list[Shape]]
"""Shapes by link."""


def trunk() -> Drawing:
    """Torso, head, waist and pelvis."""
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
    """The right arm up to the wrist, stretched out to the side."""
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
    """The right leg."""
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
    """What is touched of the right arm and leg: coarse, a shape or two for each link."""
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
    """What is touched of torso, head and pelvis."""
    return {
        "base_link": [block((-0.02, 0.0, 0.24), (0.22, 0.26, 0.36), "")],
        "Link_head_pitch": [ball((0.02, 0.0, 0.58), 0.11, "")],
        "Link_waist_yaw": [block((-0.03, 0.0, -0.155), (0.15, 0.19, 0.10), "")],
    }
