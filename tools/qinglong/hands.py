"""The hands of the QingLong, five fingers each; each link drawn in its own frame.

In the palm z points to the fingers and y to the back of the hand; a finger closes about its x.
"""

from __future__ import annotations

from cellwright.config.robot.model import RobotModel
from tools.qinglong.shapes import AZURE, DARK, RUBBER, SHELL, Shape, ball, block, capsule, rod

_FINGERS = ("ff", "mf", "rf", "lf")


def hand(robot: RobotModel, side: str) -> dict[str, list[Shape]]:
    """What is seen of a hand, by link.

    Args:
        robot: gives the lengths.
        side: `rh` or `lh`.
    """
    out = 1.0 if side == "rh" else -1.0  # where the index finger and the thumb are
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
    """What is touched of a hand, by link."""
    touched = {f"{side}_palm": [block((0.0, 0.0, 0.045), (0.056, 0.022, 0.075), "")]}
    for finger in _FINGERS:
        upper = f"{side}_{finger.upper()}"
        for part, joint in (("proximal", f"{upper}J2"), ("middle", f"{upper}J1"), ("distal", f"{upper}tip")):
            touched[f"{side}_{finger}{part}"] = [_core(robot, joint, 0.007)]
    for part, joint in (("proximal", "THJ3"), ("middle", "THJ1"), ("distal", "thtip")):
        touched[f"{side}_th{part}"] = [_core(robot, f"{side}_{joint}", 0.008)]
    return touched


def _length(robot: RobotModel, joint: str) -> float:
    """How far a joint lies along the finger from the one before it [m]."""
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
