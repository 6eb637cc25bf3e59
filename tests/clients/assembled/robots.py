"""A robot for tests of `AssembledRobot`: the smallest URDF and configuration with every kind of part."""

from pathlib import Path
from typing import Any

URDF = """\
<robot name="small">
  <link name="base"><inertial><mass value="10"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  {joints}
</robot>
"""

JOINT = """\
<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{name}_link"/><origin xyz="{xyz}"/>
  <axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}" effort="100" velocity="3"/></joint>
<link name="{name}_link"><inertial><mass value="1"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
"""

JOINTS = (
    ("lift", "prismatic", "base", "0 0 0.5", "0 0 1", 0.0, 0.4),
    ("shoulder", "revolute", "lift_link", "0.1 0 0", "0 1 0", -2.0, 2.0),
    ("tip", "fixed", "shoulder_link", "0.3 0 0", "0 0 1", 0.0, 0.0),
    ("finger", "prismatic", "tip_link", "0 0.02 0", "0 1 0", 0.0, 0.04),
    ("thumb", "prismatic", "tip_link", "0 -0.02 0", "0 -1 0", 0.0, 0.02),
    ("neck", "revolute", "lift_link", "0 0 0.4", "0 0 1", -1.5, 1.5),
    ("nod", "revolute", "neck_link", "0 0 0.1", "0 1 0", -0.7, 0.7),
)
KEYS = ("name", "type", "parent", "xyz", "axis", "lower", "upper")


def write_urdf(folder: Path) -> Path:
    """Write the URDF of the small robot; return its path."""
    file = folder / "small.urdf"
    file.write_text(URDF.format(joints="".join(JOINT.format(**dict(zip(KEYS, row, strict=True))) for row in JOINTS)))
    return file


def configs() -> dict[str, Any]:
    """Return its configuration, as `yaml.safe_load` returns it."""
    return {
        "urdf_path": "small.urdf",
        "base_pose": {"position": [0, 0, 0.2], "orientation": [0, 0, 0.7071068, 0.7071068]},
        "arms": [{"joint_index": [1], "ee_index": 2, "rest_j_pos": [0.5]}],
        "grippers": [{"joint_index": [3, 4]}],
        "head": {"joint_index": [-1, 6, 5], "rest_j_pos": [-1, 0.1, 0.2]},
        "dorsal": {"joint_index": 0, "rest_j_pos": 0.1},
    }
