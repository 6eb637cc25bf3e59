"""JSON Schema of the files of a trial, made from the tables of keys that read them."""

from cellwright.config.layout.schema import cell_schema
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
from cellwright.config.trial.orders import ORDER
from cellwright.config.trial.parts import BELT_PART, BIN, DROPS, EXTRAS, OPTIONS
from cellwright.config.trial.sensors import ARM_TYPES, SENSOR
from cellwright.config.trial.settings import OWN

SECTIONS = Keys(
    optional={
        "arm": Elsewhere({"type": "object", "properties": {"type": words(ARM_TYPES)}, "required": ["type"]}),
        "sensors": Elsewhere(lambda: mapping(SENSOR.schema())),
        "options": Elsewhere(OPTIONS.schema),
        "time_limit": Elsewhere(NUMBER),
        "orders": Elsewhere(lambda: mapping(ORDER.schema())),
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
    own = {**OWN.schema(), "description": "Cellwright's own section: seed, timestep, arm, own parts and cameras."}
    return {
        "$schema": DRAFT,
        "title": "Trial of Cellwright",
        **sections,
        "properties": {**sections["properties"], "cell": cell_schema(), "cellwright": own},
        "additionalProperties": False,
    }


def _by_time(values: Schema) -> Schema:
    """Return the schema of a mapping of times [s] to values."""
    return {**mapping(values), "propertyNames": {"pattern": NUMBER_PATTERN}}
