"""Settings of the section `cellwright`: seed, timestep and the arm's control. Strict: every mistake is an error."""

import re
from fractions import Fraction
from typing import Any, get_args

from cellwright.config.layout import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT
from cellwright.config.models.reader import read_furniture, read_part_models
from cellwright.config.parsing import expressions
from cellwright.config.parsing.reader import Keys, Read, Reader, one_of, section, whole
from cellwright.config.parsing.tree import Leaf, Table, YamlNode, describe, shortened
from cellwright.config.trial.sensors import read_plugin_devices
from cellwright.config.trial.trial import ArmSettings, CellSettings, JointGains, JointTolerance, ServoProfile
from cellwright.util.errors import ExpressionError

MIN_TIMESTEP = Fraction(1, 100_000)
MAX_TIMESTEP = Fraction(1, 50)
MAX_SEED = 2**63 - 1

_STEP = re.compile(r"\s*(\d{1,12})\s*/\s*(\d{1,12})\s*|\s*(\d{0,12}\.?\d{1,12}([eE]-?\d{1,2})?)\s*", re.ASCII)
_NOT_NEGATIVE = Reader.not_negative
GAINS = Keys({"p": _NOT_NEGATIVE, "d": _NOT_NEGATIVE}, {"i": _NOT_NEGATIVE, "i_clamp": _NOT_NEGATIVE}, "gain")
CONSTRAINTS = Keys(
    optional={"goal_time": _NOT_NEGATIVE, "stopped_velocity_tolerance": _NOT_NEGATIVE}, strict="joint or entry"
)
TOLERANCE = Keys(optional={"trajectory": _NOT_NEGATIVE, "goal": _NOT_NEGATIVE}, strict="tolerance")


def _timestep(reader: Reader, node: YamlNode) -> tuple[int, int] | None:
    """Return the timestep [s] as numerator and denominator in lowest terms."""
    text = str(node.value) if isinstance(node, Leaf) and isinstance(node.value, str | int | float) else ""
    match = _STEP.fullmatch(text)
    try:
        step = Fraction(text.replace(" ", "")) if match else None
    except ZeroDivisionError:
        step = None
    if step is None:
        reader.problems.error(node, f"must be seconds as a decimal or a fraction such as 1/500 (got {describe(node)})")
        return None
    if not MIN_TIMESTEP <= step <= MAX_TIMESTEP:
        reader.problems.error(node, f"must be from {MIN_TIMESTEP} to {MAX_TIMESTEP} s (got {shortened(text)})")
        return None
    return step.numerator, step.denominator


def _by_joint(read: Read) -> Keys:
    """Return the keys of a mapping of joints to values, each of which `read` reads."""
    return Keys(optional=dict.fromkeys(ARM_JOINTS, read), strict="joint")


def _constraints(reader: Reader, node: YamlNode) -> dict[str, Any] | None:
    """Return fields of the arm's settings: constraints of all joints, and the tolerances of single ones."""
    table = reader.table(node)
    if table is None:
        return None
    tolerances = _by_joint(section(TOLERANCE, JointTolerance)).values(table, reader)
    return CONSTRAINTS.read(table, reader, ARM_JOINTS) | {"tolerances": tolerances}


def _initial(reader: Reader, node: YamlNode) -> dict[str, float]:
    """Return joint positions, which may be expressions; values that cannot be evaluated have been reported before."""
    states: dict[str, float] = {}
    if isinstance(node, Table):
        reader.refuse_unknown(node, ARM_JOINTS, "joint")
    for entry in node.entries.values() if isinstance(node, Table) else ():
        if entry.name not in ARM_JOINTS:
            continue
        limit = RAIL_LIMIT if entry.name == ARM_JOINTS[0] else TURN_LIMIT
        try:
            position = expressions.expression_value(entry.value)
        except ExpressionError:
            continue
        if abs(position) > limit:
            reader.problems.error(entry, f"must be within the joint's limits of ±{limit:g} (got {position:g})")
        states[str(entry.name)] = position
    return states


OWN_ARM = Keys(
    optional={
        "servo": one_of(get_args(ServoProfile), "servo profile"),
        "gains": section(_by_joint(section(GAINS, JointGains)), dict),
        "dry_friction": section(_by_joint(_NOT_NEGATIVE), dict),
        "constraints": _constraints,
        "stop_trajectory_duration": _NOT_NEGATIVE,
        "allow_partial_joints_goal": Reader.boolean,
        "initial_joint_states": _initial,
    },
    strict="entry",
)
"""Keys under `arm` in the section `cellwright`."""

OWN = Keys(
    optional={
        "seed": whole(0, MAX_SEED),
        "timestep": _timestep,
        "collision_culling": Reader.boolean,
        "arm": section(OWN_ARM, dict),
        "parts": read_part_models,
        "furniture": read_furniture,
        "sensors": None,
        "devices": read_plugin_devices,
    },
    strict="entry",
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
