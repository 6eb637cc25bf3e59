"""Readers of single values of a trial, for the tables of its keys."""

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, get_args

from cellwright.config.arm import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT, JointTolerance
from cellwright.config.parsing import expressions
from cellwright.config.parsing.reader import Keys, Placement, Read, Reader, one_of, section, whole
from cellwright.config.parsing.schema import EXPRESSION, NAME, Schema, accepts, bounded, mapping, schema_of, words
from cellwright.config.parsing.tree import Items, Leaf, Table, YamlNode, children, describe, shortened
from cellwright.config.sensors import CameraType, SensorType
from cellwright.util.errors import ExpressionError

MIN_TIMESTEP = Fraction(1, 100_000)
MAX_TIMESTEP = Fraction(1, 50)

MAX_ROW = 100
"""Maximum number of parts in a row of a grid."""
_STEP = re.compile(r"\s*(\d{1,12})\s*/\s*(\d{1,12})\s*|\s*(\d{0,12}\.?\d{1,12}([eE]-?\d{1,2})?)\s*", re.ASCII)
_NOT_NEGATIVE = Reader.not_negative
CONSTRAINTS = Keys(
    optional={"goal_time": _NOT_NEGATIVE, "stopped_velocity_tolerance": _NOT_NEGATIVE},
    strict="joint or entry",
    texts="constraints",
)
TOLERANCE = Keys(optional={"trajectory": _NOT_NEGATIVE, "goal": _NOT_NEGATIVE}, strict="tolerance", texts="tolerances")
SENSOR_TYPES: tuple[str, ...] = get_args(SensorType)
CAMERA_TYPES: tuple[str, ...] = get_args(CameraType)


@accepts({**bounded(NAME, float(MIN_TIMESTEP), float(MAX_TIMESTEP)), "pattern": rf"^({_STEP.pattern})$"})
def read_timestep(reader: Reader, node: YamlNode) -> tuple[int, int] | None:
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


def by_joint(read: Read) -> Keys:
    """Return the keys of a mapping of joints to values, each of which `read` reads."""
    return Keys(optional=dict.fromkeys(ARM_JOINTS, read), strict="joint")


@accepts(lambda: _constraints_schema())
def read_constraints(reader: Reader, node: YamlNode) -> dict[str, Any] | None:
    """Return fields of the arm's settings: constraints of all joints, and the tolerances of single ones."""
    table = reader.table(node)
    if table is None:
        return None
    tolerances = by_joint(section(TOLERANCE, JointTolerance)).values(table, reader)
    return CONSTRAINTS.read(table, reader, ARM_JOINTS) | {"tolerances": tolerances}


@accepts({"type": "object", "properties": dict.fromkeys(ARM_JOINTS, EXPRESSION), "additionalProperties": False})
def read_initial_joints(reader: Reader, node: YamlNode) -> dict[str, float]:
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


@accepts({"type": "boolean"})
def read_switch(reader: Reader, node: YamlNode) -> bool:
    """Return a switch. A value that is no truth value counts as in Python, as in the original."""
    if isinstance(node, Leaf) and isinstance(node.value, bool):
        return node.value
    truth = bool(node.value if isinstance(node, Leaf) else children(node))
    reader.problems.warn(node, f"should be true or false (got {describe(node)}); counts as {str(truth).lower()}")
    return truth


@accepts(mapping(NAME))
def read_aliases(reader: Reader, node: YamlNode) -> Mapping[str, str]:
    """Return the types of parts by their aliases."""
    table = reader.table(node)
    aliases: dict[str, str] = {}
    for entry in table.entries.values() if table else ():
        alias, part_type = reader.key(entry), reader.name(entry.value)
        if alias is not None and part_type is not None:
            aliases[alias] = part_type
    return aliases


@accepts(lambda: {**schema_of(Reader.placement), "required": ["xyz"]})
def read_destination(reader: Reader, node: YamlNode) -> Placement | None:
    """Return the place for the parts of a drop region; it must have a position."""
    table = reader.table(node)
    return reader.placement(table) if table and reader.required(table, "xyz") else None


@accepts(words(CAMERA_TYPES))
def read_camera_type(reader: Reader, node: YamlNode) -> str | None:
    """Return the type of a camera; types of other sensors are refused with their place."""
    kind = reader.name(node)
    if kind in SENSOR_TYPES:
        reader.problems.error(node, f"a {kind} belongs in the top-level section sensors")
        return None
    return one_of(CAMERA_TYPES, "camera type")(reader, node) if kind is not None else None


def _constraints_schema() -> Schema:
    """Return the schema of constraints: those of all joints, and tolerances by joint."""
    own = CONSTRAINTS.schema()
    return {**own, "properties": {**own["properties"], **dict.fromkeys(ARM_JOINTS, TOLERANCE.schema())}}


@accepts(
    {"type": "array", "items": {"type": "integer", "minimum": 1, "maximum": MAX_ROW}, "minItems": 2, "maxItems": 2}
)
def read_grid(reader: Reader, node: YamlNode) -> tuple[int, int] | None:
    """Return the numbers of parts along x and y."""
    if not isinstance(node, Items) or len(node.items) != 2:
        found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
        reader.problems.error(node, f"must be [columns, rows] (got {found})")
        return None
    first, second = (whole(1, MAX_ROW, "parts")(reader, item) for item in node.items)
    return None if first is None or second is None else (first, second)
