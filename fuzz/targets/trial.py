"""Trials changed as trees: entries dropped, doubled, renamed, moved, of other types and sizes."""

from __future__ import annotations

import random
from collections.abc import Iterator

from cellwright.config.trial.gear2017 import TOP_LEVEL
from fuzz import seeds as bundled
from fuzz import yaml_trees
from fuzz.targets import trial_text

MAX_SIZE = 30_000
WORDS = (
    *TOP_LEVEL,
    *("cellwright", "seed", "timestep", "arm", "servo", "gains", "constraints", "goal_time", "initial_joint_states"),
    *("elbow_joint", "wrist_1_joint", "linear_arm_actuator_joint", "p", "d", "i", "i_clamp", "trajectory", "goal"),
    *(
        "parts",
        "furniture",
        "devices",
        "shapes",
        "box",
        "sphere",
        "cylinder",
        "capsule",
        "mesh",
        "scale",
        "use",
        "mass",
    ),
    *("color", "file", "name", "radius", "length", "type", "pose", "xyz", "rpy", "models", "bin7", "gear_part"),
    *("num_models_x", "num_models_y", "xyz_start", "xyz_end", "announcement_condition", "kit_count", "drop_regions"),
    *("announcement_condition_value", "min", "max", "destination", "part_type_to_drop", "belt_population_cycles"),
    *("insert_agvs", "insert_models_over_bins", "spawn_extra_models", "fill_demo_tray", "model_type_aliases"),
    *("break_beam_1", "logical_camera_1", "world", "bin5::link", "1.5", "order_0", "order_1"),
)
attempt = trial_text.attempt


def seeds() -> Iterator[bytes]:
    """Yield the trials."""
    yield from bundled.files(*bundled.TRIALS)


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another trial."""
    return yaml_trees.mutate(data, chance, WORDS)
