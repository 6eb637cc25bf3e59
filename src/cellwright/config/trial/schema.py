"""JSON Schema of the files of a trial, made from the tables of keys that read them."""

from cellwright.config.layout.schema import cell_schema
from cellwright.config.layout.values import changed_schema
from cellwright.config.parsing.reader import Keys
from cellwright.config.parsing.schema import (
    DRAFT,
    NAME,
    NUMBER,
    NUMBER_PATTERN,
    Elsewhere,
    Schema,
    array,
    mapping,
    words,
)
from cellwright.config.trial.cell_sensors import SENSOR as CELL_SENSOR
from cellwright.config.trial.orders import ORDER
from cellwright.config.trial.parts import BELT_PART, BIN, DROPS, EXTRAS, OPTIONS
from cellwright.config.trial.sensors import ARM_TYPES, SENSOR
from cellwright.config.trial.settings import OWN
from cellwright.config.trial.short_orders import SHORT_ORDER
from cellwright.config.trial.short_parts import parts_schema
from cellwright.config.trial.task_reader import TASK

SECTIONS = Keys(
    optional={
        "arm": Elsewhere({"type": "object", "properties": {"type": words(ARM_TYPES)}, "required": ["type"]}),
        "sensors": Elsewhere(lambda: mapping(SENSOR.schema())),
        "options": Elsewhere(OPTIONS.schema),
        "time_limit": Elsewhere(NUMBER),
        "orders": Elsewhere(lambda: mapping(_order())),
        "models_over_bins": Elsewhere(lambda: mapping(BIN.schema())),
        "belt_parts": Elsewhere(lambda: mapping(_by_time(BELT_PART.schema()))),
        "faulty_parts": Elsewhere(array(NAME, 0)),
        "drops": Elsewhere(DROPS.schema),
        "models_to_spawn": Elsewhere(lambda: mapping(EXTRAS.schema())),
    },
    texts="sections",
)
"""Sections of the 2017 format."""


def trial_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a trial's file.

    It refuses values of a wrong kind, missing entries, and unknown ones where the loader does. The loader checks more:
    names that refer to each other, expressions, bounds of several values together.

    Example:
        >>> trial_schema()["properties"]["time_limit"]["type"]
        ['number', 'string']
    """
    sections = SECTIONS.schema()
    task = {**TASK.schema(), "description": "What is to be done, and when it has succeeded."}
    own = {**OWN.schema(), "description": "Cellwright's own section: seed, timestep, arm, own parts and cameras."}
    return {
        "$schema": DRAFT,
        "title": "Trial of Cellwright",
        **sections,
        "properties": {**sections["properties"], "cell": _cell(), "parts": _parts(), "task": task, "cellwright": own},
        "additionalProperties": False,
    }


def _order() -> Schema:
    """Return the schema of an order: in short, or in the 2017 format."""
    short = {
        "anyOf": [
            {"required": ["kits"]},
            {"required": ["tray"]},
            {"required": ["parts"], "properties": {"parts": {"type": "array"}}},
        ],
        "not": {"required": ["announcement_condition"]},
    }
    return {"if": short, "then": SHORT_ORDER.schema(), "else": ORDER.schema()}


def _cell() -> Schema:
    """Return the schema of the section `cell` with its sensors."""
    cell = cell_schema()
    sensors = {**cell["properties"]["sensors"], **mapping(changed_schema(CELL_SENSOR))}
    whole = {"additionalProperties": {"type": "object", "required": list(CELL_SENSOR.required)}}
    without_base = {"properties": {**cell["else"]["properties"], "sensors": whole}}
    return {**cell, "properties": {**cell["properties"], "sensors": sensors}, "else": without_base}


def _parts() -> Schema:
    text = "Parts in bins and on belts, in short: [{type, in, grid}, {type, on, every}]; default: none."
    return {**parts_schema(), "description": text}


def _by_time(values: Schema) -> Schema:
    """Return the schema of a mapping of times [s] to values."""
    return {**mapping(values), "propertyNames": {"pattern": NUMBER_PATTERN}}
