"""Settings of the section `cellwright`: seed, timestep and the arm's control. Strict: every slip is an error."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, cast, get_args

from cellwright.config.layout import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT
from cellwright.config.parsing import expressions
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Leaf, Node, Table, described, shortened
from cellwright.config.trial import keys
from cellwright.config.trial.trial import ArmSettings, CellSettings, JointGains, JointTolerance, ServoProfile
from cellwright.util.errors import ExpressionError, did_you_mean

SHORTEST_STEP = Fraction(1, 100_000)
LONGEST_STEP = Fraction(1, 50)
LARGEST_SEED = 2**63 - 1

_PROFILES: tuple[str, ...] = get_args(ServoProfile)
_STEP = re.compile(r"\s*(\d{1,12})\s*/\s*(\d{1,12})\s*|\s*(\d{0,12}\.?\d{1,12}([eE]-?\d{1,2})?)\s*", re.ASCII)


@dataclass(frozen=True, slots=True)
class RawSettings:
    """The settings, and the joint positions [rad or m] that the arm begins with where they are not the usual ones."""

    settings: CellSettings = field(default_factory=CellSettings)
    initial_joint_states: Mapping[str, float] = field(default_factory=dict)


def read_settings(node: Node, reader: Reader) -> RawSettings:
    """The section `cellwright`."""
    table = reader.table(node)
    if table is None:
        return RawSettings()
    _only(table, keys.OWN.names, reader)
    values: dict[str, Any] = {}
    seed = table.get("seed")
    if seed and (number := reader.whole(seed)) is not None:
        values["seed"] = number
        if number > LARGEST_SEED:
            reader.problems.error(seed, f"must be at most {LARGEST_SEED}")
    step = table.get("timestep")
    if step and (ratio := _timestep(step, reader)):
        values["timestep"] = ratio
    arm = table.get("arm")
    states: Mapping[str, float] = {}
    if arm and (arm_table := reader.table(arm)):
        values["arm"], states = _arm(arm_table, reader)
    return RawSettings(CellSettings(**values), states)


def _only(table: Table, known: tuple[str, ...], reader: Reader, kind: str = "entry") -> None:
    for entry in table.entries.values():
        if entry.name not in known:
            suggestion = did_you_mean(str(entry.name), known) or f" (known: {', '.join(known)})"
            reader.problems.error(entry, f"unknown {kind}{suggestion}")


def _timestep(node: Node, reader: Reader) -> tuple[int, int] | None:
    """The timestep [s] as numerator and denominator in lowest terms."""
    text = str(node.value) if isinstance(node, Leaf) and isinstance(node.value, str | int | float) else ""
    match = _STEP.fullmatch(text)
    try:
        step = Fraction(text.replace(" ", "")) if match else None
    except ZeroDivisionError:
        step = None
    if step is None:
        reader.problems.error(node, f"must be seconds as a decimal or a fraction such as 1/500, not {described(node)}")
        return None
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        reader.problems.error(node, f"must be from {SHORTEST_STEP} to {LONGEST_STEP} s, not {shortened(text)}")
        return None
    return step.numerator, step.denominator


def _arm(table: Table, reader: Reader) -> tuple[ArmSettings, Mapping[str, float]]:
    _only(table, keys.OWN_ARM.names, reader)
    values: dict[str, Any] = {}
    if (servo := table.get("servo")) and (profile := _profile(servo, reader)):
        values["servo"] = profile
    if (gains := table.get("gains")) and (gains_table := reader.table(gains)):
        values["gains"] = _gains(gains_table, reader)
    if (friction := table.get("dry_friction")) and (friction_table := reader.table(friction)):
        values["dry_friction"] = _numbers(
            friction_table, tuple(str(each.name) for each in _joints(friction_table, reader)), reader
        )
    if (constraints := table.get("constraints")) and (constraint_table := reader.table(constraints)):
        values |= _constraints(constraint_table, reader)
    if (stop := table.get("stop_trajectory_duration")) and (duration := _positive(stop, reader)) is not None:
        values["stop_trajectory_duration"] = duration
    if partial := table.get("allow_partial_joints_goal"):
        values["allow_partial_joints_goal"] = _truth(partial, reader)
    states = table.get("initial_joint_states")
    return ArmSettings(**values), _initial(states, reader) if states else {}


def _profile(node: Node, reader: Reader) -> ServoProfile | None:
    name = reader.name(node)
    if name in _PROFILES:
        return cast("ServoProfile", name)
    if name is not None:
        suggestion = did_you_mean(name, _PROFILES) or f" (known: {', '.join(_PROFILES)})"
        reader.problems.error(node, f"unknown servo profile {shortened(name)!r}{suggestion}")
    return None


def _joints(table: Table, reader: Reader, others: tuple[str, ...] = ()) -> list[Entry]:
    _only(table, (*ARM_JOINTS, *others), reader, "joint" if not others else "joint or entry")
    return [entry for entry in table.entries.values() if entry.name in ARM_JOINTS]


def _gains(table: Table, reader: Reader) -> dict[str, JointGains]:
    gains: dict[str, JointGains] = {}
    for entry in _joints(table, reader):
        joint = reader.table(entry.value)
        if joint is None:
            continue
        _only(joint, keys.GAINS.names, reader, "gain")
        for name in keys.GAINS.required:
            reader.required(joint, name)
        values = _numbers(joint, keys.GAINS.names, reader)
        if values.keys() >= set(keys.GAINS.required):
            gains[str(entry.name)] = JointGains(**values)
    return gains


def _constraints(table: Table, reader: Reader) -> dict[str, Any]:
    values: dict[str, Any] = dict(_numbers(table, keys.CONSTRAINTS.names, reader))
    tolerances: dict[str, JointTolerance] = {}
    for entry in _joints(table, reader, keys.CONSTRAINTS.names):
        joint = reader.table(entry.value)
        if joint is not None:
            _only(joint, keys.TOLERANCE.names, reader, "tolerance")
            tolerances[str(entry.name)] = JointTolerance(**_numbers(joint, keys.TOLERANCE.names, reader))
    return values | {"tolerances": tolerances}


def _numbers(table: Table, names: tuple[str, ...], reader: Reader) -> dict[str, float]:
    values: dict[str, float] = {}
    for name in names:
        node = table.get(name)
        if node and (number := _positive(node, reader)) is not None:
            values[name] = number
    return values


def _positive(node: Node, reader: Reader) -> float | None:
    number = reader.number(node)
    if number is not None and number < 0:
        reader.problems.error(node, f"must not be negative, and is {number:g}")
        return None
    return None if number is None else float(number)


def _truth(node: Node, reader: Reader) -> bool:
    if isinstance(node, Leaf) and isinstance(node.value, bool):
        return node.value
    reader.problems.error(node, f"must be true or false, not {described(node)}")
    return False


def _initial(node: Node, reader: Reader) -> dict[str, float]:
    """Joint positions, which may be expressions; values that cannot be computed have been reported before."""
    states: dict[str, float] = {}
    for entry in _joints(node, reader) if isinstance(node, Table) else ():
        limit = RAIL_LIMIT if entry.name == ARM_JOINTS[0] else TURN_LIMIT
        try:
            position = expressions.expression_value(entry.value)
        except ExpressionError:
            continue
        if abs(position) > limit:
            reader.problems.error(entry, f"{position:g} is beyond the joint's limit of {limit:g}")
        states[str(entry.name)] = position
    return states
