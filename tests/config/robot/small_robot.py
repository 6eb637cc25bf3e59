"""Robot with two arms of two joints, grippers, head, lift and a wheel, in which the two orders of counting differ."""

from pathlib import Path

_JOINTS = (  # name, type, parent, child, origin, axis, limits, mimic; in the order of the file
    ("lift", "prismatic", "base", "torso", "0 0 0.5", "0 0 1", (0.0, 0.4), ""),
    ("r1", "revolute", "torso", "r_upper", "0 -0.2 0", "0 1 0", (-2.0, 2.0), ""),
    ("l1", "revolute", "torso", "l_upper", "0 0.2 0", "0 1 0", (-2.0, 2.0), ""),
    ("r2", "revolute", "r_upper", "r_lower", "0.3 0 0", "0 1 0", (0.0, 2.5), ""),
    ("l2", "revolute", "l_upper", "l_lower", "0.3 0 0", "0 1 0", (0.0, 2.5), ""),
    ("r_wrist", "fixed", "r_lower", "r_hand", "0.3 0 0", "", None, ""),
    ("l_wrist", "fixed", "l_lower", "l_hand", "0.3 0 0", "", None, ""),
    ("r_finger", "prismatic", "r_hand", "r_jaw", "0 0.01 0", "0 1 0", (0.0, 0.04), ""),
    ("r_thumb", "prismatic", "r_hand", "r_other_jaw", "0 -0.01 0", "0 1 0", (-0.04, 0.0), "r_finger"),
    ("l_finger", "prismatic", "l_hand", "l_jaw", "0 0.01 0", "0 1 0", (0.0, 0.04), ""),
    ("l_thumb", "prismatic", "l_hand", "l_other_jaw", "0 -0.01 0", "0 1 0", (-0.04, 0.0), "l_finger"),
    ("head_yaw", "revolute", "torso", "neck", "0 0 0.3", "0 0 1", (-1.5, 1.5), ""),
    ("head_pitch", "revolute", "neck", "head", "0 0 0.1", "0 1 0", (-0.7, 0.7), ""),
    ("spin", "continuous", "base", "wheel", "0 0 0.1", "0 1 0", None, ""),
)

SHAPE = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
"""Shape of each link, since a robot without any shape causes a warning."""

INDICES = (
    *("lift", "r1", "r2", "r_wrist", "r_finger", "r_thumb"),
    *("l1", "l2", "l_wrist", "l_finger", "l_thumb", "head_yaw", "head_pitch", "spin"),
)
"""Joints in the order of their indices."""

CONFIG = """\
urdf_path: robot.urdf
wo_controller: false
robot_name: Small
base_pose: {position: [0, 0, 0.9], orientation: [0, 0, 0.707, 0.707]}
arms:
  - {joint_index: [1, 2], ee_index: 3, rest_j_pos: [0.1, 0.2]}
  - {joint_index: [6, 7], ee_index: 8, rest_j_pos: [-0.1, 0.2]}
grippers:
  - joint_index: [4, 5]
  - joint_index: [9, 10]
head: {joint_index: [-1, 12, 11], rest_j_pos: [-1, 0.3, 0]}
dorsal: {joint_index: 0, rest_j_pos: 0.25}
waist: {joint_index: [13], rest_j_pos: [0.5]}
controller_indices: {cmd_ee: [3, 8], base: [0, -1]}
vibration_thresholds: {ee_dist: [0.15, 0.2], tabletop_height: 0.85}
"""


def urdf() -> str:
    """Return the robot's file."""
    links = dict.fromkeys(["base", *(child for _, _, _, child, *_ in _JOINTS)])
    lines = ['<robot name="small">', *(f'  <link name="{name}">{SHAPE}</link>' for name in links)]
    for name, kind, parent, child, xyz, axis, limits, leader in _JOINTS:
        lower, upper = limits or (0, 0)
        bounds = f'lower="{lower}" upper="{upper}" ' if limits else ""
        lines += [
            f'  <joint name="{name}" type="{kind}">',
            f'    <parent link="{parent}"/> <child link="{child}"/> <origin xyz="{xyz}"/>',
            f'    <axis xyz="{axis}"/> <limit {bounds}effort="10" velocity="2"/>' if axis else "",
            f'    <mimic joint="{leader}" multiplier="-1"/>' if leader else "",
            "  </joint>",
        ]
    return "\n".join([*filter(None, lines), "</robot>\n"])


def write(folder: Path, config: str = CONFIG) -> Path:
    """Write robot and configuration into a folder, and return the path of the configuration."""
    (folder / "robot.urdf").write_text(urdf())
    path = folder / "vr_configs.yml"
    path.write_text(config)
    return path
