"""A trial with an entry in each section of the 2017 format and in Cellwright's own."""

from typing import Any

POSE = {"xyz": [0, 0, 1], "rpy": [0, "pi/2", 0]}
PART = {"type": "gear_part", "pose": POSE}
WHOLE: dict[str, Any] = {
    "arm": {"type": "ur10"},
    "sensors": {"beam": {"type": "break_beam", "pose": POSE}},
    "options": {
        "insert_models_over_bins": True,
        "spawn_extra_models": True,
        "model_type_aliases": {"gear": "gear_part"},
    },
    "time_limit": 60,
    "orders": {
        "order_0": {
            "announcement_condition": "time",
            "announcement_condition_value": 0,
            "parts": {"part_0": PART},
            "kit_count": 1,
        }
    },
    "models_over_bins": {
        "bin9": {
            "models": {
                "gear_part": {
                    "xyz_start": [0.1, 0.1, 0.0],
                    "xyz_end": [0.5, 0.5, 0.0],
                    "rpy": [0, 0, 0],
                    "num_models_x": 2,
                    "num_models_y": 2,
                }
            },
            "xyz": [-1.3, -1.6, 0.75],
        }
    },
    "belt_parts": {"gear_part": {1.5: {"pose": POSE}}},
    "faulty_parts": ["gear_part_1"],
    "models_to_spawn": {"world": {"models": {"one": PART}}},
    "drops": {
        "drop_regions": {
            "one": {
                "min": {"xyz": [0, 2.7, 0.6]},
                "max": {"xyz": [0.6, 3.5, 1.5]},
                "destination": POSE,
                "part_type_to_drop": "gear_part",
            }
        }
    },
    "cell": {
        "based_on": "empty",
        "arms": {"arm": {"mount": {"kind": "rail", "at": [0.3, 0, 0.9]}}},
        "frame": {"at": [1, 0], "turn": "pi/2"},
        "bins": {"bin9": {"at": [3, 3], "turn": 0, "size": [0.6, 0.6], "open": ["+x"], "walls": 0.1}},
        "belts": {"side": {"from": [4, 0], "to": [4, 3], "width": 0.5, "wall": {"at": [4, 2.8, 1.4]}}},
        "trays": {"tray1": {"at": [5, 0], "rim": 0.02}},
        "structure": {"post": {"at": [6, 0, 0], "boxes": [{"at": [0, 0, 1], "size": [0.1, 0.1, 2]}]}},
        "places": {"aside": {"at": [0, 0, 1], "turn": 1}},
        "views": {"side": {"at": [9, 0, 3], "to": [0, 0, 1], "angle": 0.8}},
        "floor_lines": [{"at": [1, 1], "size": [2, 0.1]}],
        "shelf": [1, -40],
        "sensors": {"beam9": {"type": "break_beam", "over": "bin9", "height": 0.5}},
    },
    "parts": [
        {"type": "gear_part", "in": "bin9", "grid": [2, 2], "from": [0.1, 0.1], "step": [0.2, 0.2], "turn": 0},
        {"type": "gear_part", "on": "side", "every": 10, "after": 1, "across": 0, "count": 3},
    ],
    "task": {
        "sentence": "Pick up a gear.",
        "success": [
            {"held": {"part": "gear_part", "lifted": 0.1, "by": "arm"}, "kit": "full", "score": 1},
            {"on_tray": {"part": "gear_part", "tray": "tray1", "at": [0, 0], "yaw": "pi/2", "tolerance": 0.03}},
            {"discarded": {"tray": "tray1"}, "turned": {"part": "gear_part", "tolerance": 0.2}},
        ],
        "start": {"joints": {"elbow_joint": "pi/2"}, "jitter": 0.1, "holding": "gear_part"},
        "hold_for": 1,
        "reward": "shaped",
        "starts_competition": True,
    },
    "cellwright": {
        "seed": 1,
        "timestep": "1/500",
        "collision_culling": True,
        "arm": {
            "servo": "precise",
            "gains": {"elbow_joint": {"p": 1, "d": 1, "i": 1, "i_clamp": 1}},
            "constraints": {"goal_time": 0.5, "elbow_joint": {"trajectory": 0.1, "goal": 0.1}},
            "initial_joint_states": {"elbow_joint": "pi/2"},
        },
        "parts": {"cube": {"mass": 0.2, "color": [1, 0, 0], "shapes": [{"box": [0.04, 0.04, 0.04], "use": "both"}]}},
        "furniture": [{"name": "table", "pose": POSE, "shapes": [{"cylinder": {"radius": 0.1, "length": 0.2}}]}],
        "sensors": {"eye": {"type": "rgbd_camera", "pose": POSE, "width": 640, "noise": {"depth": 0.01}}},
    },
}
