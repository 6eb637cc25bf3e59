"""The entries of a robot configuration file, in all its revisions, and what becomes of each."""

from __future__ import annotations

from collections.abc import Mapping

from cellwright.config.parsing.reader import REQUIRED, TRUTH, Key, Keys, Reader, choice, numbers, words

BASE_COMMAND_MODES = ("delta", "velocity")
INDEX_ORDERS = ("pybullet", "urdf")
"""How a file counts joints; the first when it does not say."""

_JOINTS = "list of indices or names"
_HOME = "list of positions, rad or m"
_POSTURE = "`{joint_index, rest_j_pos, max_acceleration}`"

ENTRIES = Keys(
    Key("urdf_path", "path", "URDF or xacro file, counted from the file's folder, or from the one above", REQUIRED),
    Key("robot_name", "text", "a label", "the URDF's", Reader.name),
    Key("base_pose", "`{position, orientation}`", "the root link, or the fixed one, in the world", "at the origin"),
    Key(
        "fixed_link",
        "index or name",
        "the link that is fastened to the world in place of the root; the base cannot be moved then",
        "the root",
    ),
    Key(
        "joint_index_order",
        words(INDEX_ORDERS, " or "),
        "how the file's indices count, see above",
        f"`{INDEX_ORDERS[0]}`",
        choice(INDEX_ORDERS),
    ),
    Key("arms", "list, right before left", "see below"),
    Key("grippers", "list, right before left", "see below"),
    Key(
        "head",
        _POSTURE,
        "three joints in the order roll, pitch, yaw, with -1 for what the head lacks, and as many positions",
    ),
    Key("dorsal", _POSTURE, "the lift of the torso: one joint; it goes home to 0 where none is said"),
    Key("waist", _POSTURE, "the waist"),
    Key("folding_waist", "as `waist`", "more joints of the waist; `rot_offset`, `cmd_ee` and `base` are not used"),
    Key("controller_indices", "`{cmd_ee, base}`", "which poses `target_ee_poses` commands, see below", "see below"),
    Key("cameras", "list", "cameras that take pictures, see below"),
    Key(
        "wo_controller",
        TRUTH,
        "whether the robot is run without the stack's own controller; kept, and not used, as in the original's nodes",
        default=False,
        read=Reader.truth,
    ),
    Key(
        "base_command_mode",
        words(BASE_COMMAND_MODES, " or "),
        "messages on `target_base_move` have three numbers: turn, move forward and sideways by so much (rad, m) or so "
        "fast (rad/s, m/s)",
        "two numbers, as in the original",
        choice(BASE_COMMAND_MODES),
    ),
)
READ = ENTRIES.names
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

_MAX_ACCELERATION = Key(
    "max_acceleration",
    "rad/s², m/s²: a number, or a list with one for each joint",
    "how fast the targets of its joints may change their speed, see below",
    "no bound",
)
ARMS = Keys(
    Key("joint_index", _JOINTS, "its joints, from the shoulder on", REQUIRED),
    Key("ee_index", "index or name", "the link at its tip", REQUIRED),
    Key("rest_j_pos", _HOME, "home, a position for each joint", REQUIRED),
    _MAX_ACCELERATION,
)
GRIPPERS = Keys(
    Key("joint_index", _JOINTS, "its joints; those that mimic others may be named or not", REQUIRED),
    Key(
        "open",
        "`lower` or `upper`, or a list with one for each joint",
        "the limit at which its joints are open (status 0); the other one is closed (1). Not known to the original",
        "`lower`",
    ),
    _MAX_ACCELERATION,
)
GRIPPER_UNUSED = ("thumb", "index", "middle", "ring", "pinky")
"""Lists of the joints of each finger: old revisions have them, and only `joint_index` was ever read."""
POSTURE = ("joint_index", "rest_j_pos", "max_acceleration")
FOLDING_WAIST_UNUSED = ("rot_offset", "cmd_ee", "base")
CAMERAS = Keys(
    Key(
        "name",
        "letters, digits and `_`",
        "its topics; with `hand_eye` in it, it is fixed to the tip of the right arm, with `left` too to that of the "
        "left one; any other is fixed to the head, or to the root where there is no head",
        REQUIRED,
    ),
    Key("pos_offset", "`[x, y, z]`, m", "where it is, in the frame of that link", "`[0, 0, 0]`"),
    Key("target_offset", "`[x, y, z]`, m", "the point that it looks at, in the same frame", "ahead, along +x"),
    Key("quat", "`[x, y, z, w]`", "turns both of these", "`[0, 0, 0, 1]`"),
    Key("height", "m", "is added to where it is, along z", 0.0),
    Key("up_axis", "`x`, `y`, `z`; 0, 1, 2; or `[x, y, z]`", "what is up in its pictures", "`z`"),
    Key("near_val", "m", "depths below this are not measured", 0.1),
    Key("far_val", "m", "depths above this are not measured", 10.0),
    Key("img_width", "pixels", "width of its pictures", 640),
    Key("img_height", "pixels", "height of its pictures; it sees 100° up and down together", 480),
)
BASE_POSES = Keys(
    Key("position", "`[x, y, z]`, m", "where it is", "`[0, 0, 0]`", numbers(3, "x, y, z [m]")),
    Key(
        "orientation",
        "`[x, y, z, w]`",
        "a quaternion, which is scaled to unit length",
        "`[0, 0, 0, 1]`",
        numbers(4, "x, y, z, w"),
    ),
)
CONTROLLERS = Keys(
    Key("cmd_ee", "a link for each arm", "whose poses are commanded", "the arms' tips"),
    Key("base", "a link for each arm", "in whose frames they are given; -1 is the robot's base", "the robot's base"),
)
