"""The entries of a robot configuration file, in all its revisions, and what becomes of each."""

from __future__ import annotations

from collections.abc import Mapping

READ = (
    "urdf_path",
    "robot_name",
    "base_pose",
    "fixed_link",
    "joint_index_order",
    "arms",
    "grippers",
    "head",
    "dorsal",
    "waist",
    "folding_waist",
    "controller_indices",
    "cameras",
    "wo_controller",
    "base_command_mode",
)
"""Entries that say how the robot is put up, which joints belong together, and what commands mean."""

KEPT = ("base_command_mode",)
"""Those among them that are kept as they are written, as the unused ones are."""

UNUSED: Mapping[str, str] = {
    "vibration_thresholds": "when the operator's controllers shake",
    "robot_scale": "scale of the operator's motion",
    "arm_pos_scale": "scale of the operator's motion",
    "dorsal_move_scale": "scale of the operator's sticks",
    "base_move_scale": "scale of the operator's sticks",
    "base_move_filter": "smoothing of the operator's sticks",
    "base_max_acc_per_step": "smoothing of the operator's sticks",
    "base_max_dec_per_step": "smoothing of the operator's sticks",
    "ee_wrt_head": "how the operator's hands are measured",
    "non_fixed_joint_ids": "a list of joints that no revision reads",
    "finger_command_topics": "names of topics; those of the contract are served",
    "without_gui": "whether a window opens; `--gui` says so here",
    "sim_camera": "the first view of the original's window",
    "sim_opengl2": "how the original's window draws",
}
"""Entries that are known and used by nothing here, each with what it is for."""

ARM = ("joint_index", "ee_index", "rest_j_pos")
GRIPPER = ("joint_index",)
GRIPPER_UNUSED = ("thumb", "index", "middle", "ring", "pinky")
"""Lists of the joints of each finger: old revisions have them, and only `joint_index` was ever read."""
POSTURE = ("joint_index", "rest_j_pos")
FOLDING_WAIST_UNUSED = ("rot_offset", "cmd_ee", "base")
CAMERA = (
    "name",
    "quat",
    "height",
    "pos_offset",
    "target_offset",
    "near_val",
    "far_val",
    "up_axis",
    "img_width",
    "img_height",
)
BASE_POSE = ("position", "orientation")
CONTROLLER = ("cmd_ee", "base")
BASE_COMMAND_MODES = ("delta", "velocity")
INDEX_ORDERS = ("pybullet", "urdf")
