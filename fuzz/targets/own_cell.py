"""Cells of one's own, changed as trees: sections `cell` and `parts`, orders in short, and their warnings."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.cell.checks.findings import cell_warnings
from cellwright.config.layout import keys
from cellwright.config.layout.data import layout_data, layout_from_data
from cellwright.config.parsing.reader import Keys
from cellwright.config.trial import cell_sensors, short_orders, short_parts
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError
from fuzz import seeds as bundled
from fuzz import yaml_trees
from fuzz.verdict import FindingError, check_lines, check_refusal

MAX_SIZE = 8000
_TABLES = [
    each
    for module in (keys, cell_sensors, short_orders, short_parts)
    for each in vars(module).values()
    if isinstance(each, Keys)
]
WORDS = (
    *sorted({str(name) for table in _TABLES for name in table.names}),
    *("bin1", "belt", "tray1", "agv1", "agv3", "arm", "post", "base_link", "gear_part", "logical_camera_bin1"),
    *("gear2017", "empty", "wall", "drop", "rail", "+y", "pi/2", "'#e0762b'", "1e9", "-100", "0.05", "null", "{}"),
)
_PATH = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-")) / "cell.yaml"


def seeds() -> Iterator[bytes]:
    """Yield the example cells, the start of a new one, and the cell of 2017."""
    yield from bundled.files("examples/cells/*.yaml", "src/cellwright/cli/cell/start.yaml")
    yield from bundled.files("src/cellwright/config/layout/gear2017.yaml")
    yield b"cell: {based_on: gear2017, frame: {at: [2, 1]}, belts: {belt: {ends: drop}}, bins: {bin1: null}}\n"


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another cell."""
    return yaml_trees.mutate(data, chance, WORDS)


def attempt(data: bytes) -> None:
    """Load a cell; it survives the way to its clients as data, and warnings have the form of refusals."""
    _PATH.write_bytes(data)
    try:
        loaded = load_trial([_PATH])
    except DescriptionError as error:
        check_refusal(error, str(_PATH))
        return
    layout = loaded.trial.layout
    if layout_from_data(layout_data(layout)) != layout:
        raise FindingError("a layout that is another one as data")
    check_lines([*loaded.warnings, *cell_warnings(loaded.trial, loaded.places)], [str(_PATH)])
