"""Tables of the pages on configurations: `python -m tools.configuration_pages docs/*configuration.md docs/tasks.md`.

Bounds are generated from the readers' own constants, and entries from the texts of `entries.yaml`. In a page a table
stands between `<!-- made: NAME -->` or `<!-- entries: NAME -->` and `<!-- end -->`; the rest is written by hand.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

from cellwright.config.models.files import MAX_ASSET_BYTES
from cellwright.config.models.reader import MAX_FURNITURE, MAX_TYPES
from cellwright.config.models.xml import MAX_SHAPES
from cellwright.config.parsing import entries
from cellwright.config.parsing.entries import EntryText
from cellwright.config.parsing.expressions import MAX_BITS, MAX_LENGTH
from cellwright.config.parsing.overrides import MAX_OVERRIDES
from cellwright.config.parsing.reader import MAX_COORDINATE, MAX_MESH_BYTES, MAX_NAME_LENGTH
from cellwright.config.parsing.sources import MAX_BYTES
from cellwright.config.parsing.tree import MAX_PROBLEMS
from cellwright.config.parsing.yaml_source import MAX_DEPTH, MAX_NODES
from cellwright.config.robot import meshes, urdf, urdf_file
from cellwright.config.robot.config import UNUSED
from cellwright.config.robot.group_reader import GRIPPER_UNUSED
from cellwright.config.robot.robots import FOLDING_WAIST_UNUSED
from cellwright.config.sensors import (
    MAX_CAMERA_LATENCY,
    MAX_DEPTH_PIXELS,
    MAX_FOV,
    MAX_PICTURE_RATE,
    MAX_PICTURE_SIZE,
    MIN_PICTURE_RATE,
)
from cellwright.config.trial.orders import MAX_KITS
from cellwright.config.trial.parts import MAX_PARTS
from cellwright.config.trial.sensors import MAX_CAMERAS, MAX_SENSORS
from cellwright.util.errors import UnknownNameError

_MADE = re.compile(
    r"(?<=^<!-- )(?P<kind>made|entries): (?P<name>[a-z0-9-]+)(?P<open> -->\n).*?(?=^<!-- end -->$)",
    re.MULTILINE | re.DOTALL,
)


def tables() -> Mapping[str, str]:
    """Return each table, by its name."""
    return {"trial-bounds": _trial_bounds(), "robot-unused": _unused(), "robot-bounds": _robot_bounds()}


def filled(page: str) -> str:
    """Return a page with its tables generated again.

    Raises:
        UnknownNameError: the page names an unknown table.
    """
    made = {"made": tables(), "entries": {name: _entries(rows) for name, rows in entries.tables().items()}}

    def fill(found: re.Match[str]) -> str:
        kind, name = found["kind"], found["name"]
        if name not in made[kind]:
            raise UnknownNameError("table", name, made[kind])
        return f"{kind}: {name}{found['open']}\n{made[kind][name]}\n"

    return _MADE.sub(fill, page)


def _entries(rows: Mapping[str, EntryText]) -> str:
    lines = (f"| `{name}` | {' | '.join(text)} |" for name, text in rows.items())
    return "\n".join(["| entry | value | meaning | default |", "|---|---|---|---|", *lines, ""])


def _bounds(rows: Mapping[str, str]) -> str:
    lines = (f"| {label} | {value} |" for label, value in rows.items())
    return "\n".join(["| bound | value |", "|---|---|", *lines, ""])


def _trial_bounds() -> str:
    return _bounds(
        {
            "all files together": f"{MAX_BYTES >> 10} KiB",
            "replaced values; their texts": f"{MAX_OVERRIDES}; {MAX_BYTES >> 10} KiB",
            "values in a file; each use of an anchor counts": f"{MAX_NODES:,}".replace(",", " "),
            "nesting": f"{MAX_DEPTH} levels",
            "parts in a cell, including belt parts; parts of one order": f"{MAX_PARTS}",
            "kits of all orders, plus their parts": f"{MAX_KITS:,}".replace(",", " "),
            "sensors; cameras that take pictures": f"{MAX_SENSORS}; {MAX_CAMERAS}",
            "pictures of a camera": f"{MAX_PICTURE_SIZE[0]} × {MAX_PICTURE_SIZE[1]} pixels, "
            f"{MAX_DEPTH_PIXELS / 1e6:g} million with depth; {MIN_PICTURE_RATE:g} to "
            f"{MAX_PICTURE_RATE:g} Hz; {MAX_FOV:g} rad wide; {MAX_CAMERA_LATENCY:g} s late",
            "part types of your own; pieces of furniture": f"{MAX_TYPES}; {MAX_FURNITURE}",
            "shapes of one model; size of a mesh, and of all meshes of a trial": f"{MAX_SHAPES}; "
            f"{MAX_ASSET_BYTES >> 20} and {MAX_MESH_BYTES >> 20} MiB",
            "printed errors and printed warnings; the others are counted": f"{MAX_PROBLEMS}",
            "a coordinate": f"±{MAX_COORDINATE:,.0f} m".replace(",", " "),
            "an expression": f"{MAX_LENGTH} characters, intermediate whole numbers up to {MAX_BITS} bits",
            "a name": f"{MAX_NAME_LENGTH} characters",
        }
    )


def _robot_bounds() -> str:
    return _bounds(
        {
            "a robot configuration": f"{MAX_BYTES >> 10} KiB",
            "a URDF": f"{urdf_file.MAX_BYTES >> 20} MiB, {urdf.MAX_LINKS} links, "
            f"elements nested {urdf_file.MAX_DEPTH} deep",
            "all meshes of a robot": f"{meshes.MAX_TOTAL_BYTES >> 20} MiB",
        }
    )


def _unused() -> str:
    rows = [f"| `{name}` | {label} |" for name, label in UNUSED.items()]
    names = [
        *(f"grippers[].{name}" for name in GRIPPER_UNUSED),
        *(f"folding_waist.{name}" for name in FOLDING_WAIST_UNUSED),
    ]
    rows += [f"| {', '.join(f'`{name}`' for name in names)} | |"]
    return "\n".join(["| entry | meaning in the original |", "|---|---|", *rows, ""])


if __name__ == "__main__":
    for page in map(Path, sys.argv[1:]):
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
