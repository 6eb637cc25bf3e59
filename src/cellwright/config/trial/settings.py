"""Settings of the section `cellwright`: seed, timestep and the arm's control. Strict: every mistake is an error."""

from typing import Any, get_args

from cellwright.config.arm import ArmSettings, JointGains, ServoProfile
from cellwright.config.models.reader import read_furniture, read_part_models
from cellwright.config.parsing.reader import Keys, Reader, one_of, section, whole
from cellwright.config.parsing.schema import Elsewhere, mapping
from cellwright.config.parsing.tree import YamlNode
from cellwright.config.trial.sensors import CAMERA, read_plugin_devices
from cellwright.config.trial.trial import CellSettings
from cellwright.config.trial.values import by_joint, read_constraints, read_initial_joints, read_timestep

MAX_SEED = 2**63 - 1

GAINS = Keys(
    {"p": Reader.not_negative, "d": Reader.not_negative},
    {"i": Reader.not_negative, "i_clamp": Reader.not_negative},
    "gain",
    "gains",
)
OWN_ARM = Keys(
    optional={
        "servo": one_of(get_args(ServoProfile), "servo profile"),
        "gains": section(by_joint(section(GAINS, JointGains)), dict),
        "dry_friction": section(by_joint(Reader.not_negative), dict),
        "constraints": read_constraints,
        "stop_trajectory_duration": Reader.not_negative,
        "allow_partial_joints_goal": Reader.boolean,
        "initial_joint_states": read_initial_joints,
    },
    strict="entry",
    texts="own-arm",
)
"""Keys under `arm` in the section `cellwright`."""

OWN = Keys(
    optional={
        "seed": whole(0, MAX_SEED),
        "timestep": read_timestep,
        "collision_culling": Reader.boolean,
        "arm": section(OWN_ARM, dict),
        "parts": read_part_models,
        "furniture": read_furniture,
        "sensors": Elsewhere(lambda: mapping(CAMERA.schema())),
        "devices": read_plugin_devices,
    },
    strict="entry",
    texts="own",
)
"""Keys of the section `cellwright`; `read_cameras` reads its `sensors`, which depend on those of the 2017 format."""


def read_settings(node: YamlNode, reader: Reader) -> dict[str, Any]:
    """Return the fields of a trial that the section `cellwright` sets, without its cameras."""
    table = reader.table(node)
    if table is None:
        return {}
    values = OWN.read(table, reader)
    arm = values.pop("arm", {})
    states, constraints = arm.pop("initial_joint_states", {}), arm.pop("constraints", {})
    cell = {name: values.pop(name) for name in ("seed", "timestep", "collision_culling") if name in values}
    settings = CellSettings(**cell, arm=ArmSettings(**arm, **constraints))
    own = {"settings": settings, "initial_joint_states": states, "part_models": values.pop("parts", {})}
    return {**own, **values}
