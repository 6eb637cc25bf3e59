"""JSON Schema of the section `cell`."""

from cellwright.config.layout.basing import BASED_ON, EMPTY
from cellwright.config.layout.keys import ARM, BELT, BIN, CARRIER, CELL, FRAME, STRUCTURE, TRAY, VIEW
from cellwright.config.parsing.schema import Schema

_NAMED = {
    "bins": BIN,
    "belts": BELT,
    "trays": TRAY,
    "carriers": CARRIER,
    "arms": ARM,
    "structure": STRUCTURE,
    "places": FRAME,
    "views": VIEW,
}


def cell_schema() -> Schema:
    """Return the JSON Schema of the section `cell`.

    Without a base, entries are whole: nothing can be taken away, and what is required must be there.

    Example:
        >>> cell_schema()["properties"]["bins"]["type"]
        'object'
    """
    whole: Schema = {
        name: {"additionalProperties": {"type": "object", "required": list(keys.required)}}
        for name, keys in _NAMED.items()
    }
    places = {key: {"type": "array"} for key in ("from", "to", "at")}
    lines = [{"required": [*pair], "properties": places} for pair in (("from", "to"), ("at", "length"))]
    whole["belts"] = {"additionalProperties": {"type": "object", "anyOf": lines}}
    based = {"required": [BASED_ON], "properties": {BASED_ON: {"not": {"const": EMPTY}}}}
    text = "The layout of a cell of your own: bins, belts, AGVs, trays, structure; without it, the cell of 2017."
    return {**CELL.schema(), "if": based, "else": {"properties": whole}, "description": text}
