"""Robot with a torso of four serial joints and two arms of seven, each with two fingers that are closed at 0.

Masses, lengths, efforts and speeds are near those of mobile robots with two arms; the figures are invented.
"""

from __future__ import annotations

from pathlib import Path

Axis = str

TORSO = (  # origin, axis, effort [N m], mass [kg], height of the link [m]
    ("0 0 0.25", "0 1 0", 130, 6.0, 0.3),
    ("0 0 0.3", "0 1 0", 130, 6.0, 0.3),
    ("0 0 0.3", "0 1 0", 130, 3.0, 0.1),
    ("0 0 0.1", "0 0 1", 130, 11.0, 0.4),
)
ARM = (  # origin, axis, effort [N m], speed [rad/s], mass [kg]
    ("", "0 1 0", 55, 3, 1.5),
    ("0 0 0", "1 0 0", 55, 3, 1.0),
    ("0 0 -0.15", "0 0 1", 30, 3, 1.0),
    ("0 0 -0.15", "0 1 0", 30, 3, 1.0),
    ("0 0 -0.12", "0 0 1", 10, 6, 0.6),
    ("0 0 -0.12", "0 1 0", 10, 6, 0.4),
    ("0 0 -0.05", "1 0 0", 10, 6, 0.4),
)
INWARDS = (("0 1 0", 0.0, 0.04), ("0 -1 0", 0.0, 0.04))
"""Axis and range [m] of each finger: closed at 0, open at 0.04, as in OpenArm, the Panda and the R1."""


def arm_names(side: str, count: int = 7) -> tuple[str, ...]:
    """Return the joints of an arm, from the shoulder on."""
    return tuple(f"{side}_arm_joint{number}" for number in range(1, count + 1))


def urdf(
    sides: tuple[str, ...] = ("left", "right"),
    *,
    torso: int = 4,
    arm: int = 7,
    fingers: tuple[tuple[Axis, float, float], ...] = INWARDS,
) -> str:
    """Return the robot's file.

    Args:
        sides: prefixes of the names of the arms, from y = 0.2 m to y = -0.2 m; one is an arm on the torso's middle.
        torso, arm: their numbers of joints.
        fingers: axis and range of each finger.
    """
    lines = ['<robot name="torso_robot">', _link("base", 50.0, 0.2)]

    def add(name: str, kind: str, parent: str, child: str, place: str, axis: str, limit: str, mass: float) -> None:
        lines.append(_link(child, mass, 0.1 if kind == "revolute" else 0.02))
        lines.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit {limit}/></joint>'
        )

    top = "base"
    for number, (place, axis, effort, mass, _) in enumerate(TORSO[:torso], 1):
        limit = f'lower="-2" upper="2" effort="{effort}" velocity="2.5"'
        add(f"torso_joint{number}", "revolute", top, f"torso_link{number}", place, axis, limit, mass)
        top = f"torso_link{number}"
    for number, side in enumerate(sides):
        y = 0.2 - 0.4 * number if len(sides) > 1 else 0.0
        parent = top
        for name, (place, axis, effort, speed, mass) in zip(arm_names(side, arm), ARM, strict=False):
            child = name.replace("joint", "link")
            limit = f'lower="-2.5" upper="2.5" effort="{effort}" velocity="{speed}"'
            add(name, "revolute", parent, child, place or f"0 {y} 0.35", axis, limit, mass)
            parent = child
        for finger, (axis, lower, upper) in enumerate(fingers, 1):
            limit = f'lower="{lower}" upper="{upper}" effort="50" velocity="0.25"'
            name = f"{side}_gripper_joint{finger}"
            add(name, "prismatic", parent, f"{side}_gripper_link{finger}", "0 0 -0.1", axis, limit, 0.05)
    return "\n".join([*lines, "</robot>\n"])


def _link(name: str, mass: float, size: float) -> str:
    inertia = mass / 6 * size * size
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 {-size / 2}"/><mass value="{mass}"/>'
        f'<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<visual><geometry><box size="{size} {size} {size}"/></geometry></visual></link>'
    )


def write(folder: Path, text: str) -> Path:
    """Write a robot's file into a folder, and return its path."""
    path = folder / "robot.urdf"
    path.write_text(text)
    return path
