"""The table of rooms in the page on design is that of the source."""

import re
from pathlib import Path

import cellwright

SOURCE = Path(cellwright.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "design.md").read_text(encoding="utf-8")
ROWS = [line.split("|")[1] for line in PAGE.splitlines() if re.match(r"\| (· )?`", line)]
TOLD = {name for row in ROWS for name in re.findall(r"`([\w/.]+)`", row)}


def test_every_room_has_its_row() -> None:
    rooms = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    files = {path.name for path in SOURCE.glob("*.py")} - {"__init__.py"}
    assert rooms | files == {name for name in TOLD if "/" not in name}


def test_what_is_told_of_rooms_within_rooms_is_there() -> None:
    for name in TOLD:
        assert (SOURCE / name).exists(), name


def test_an_arrow_runs_from_a_room_to_those_above_it_in_the_table() -> None:
    """The order of the table is that of the layers, which import-linter checks, read from the bottom."""
    import tomllib

    project = tomllib.loads((SOURCE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = [each["layers"] for each in project["tool"]["importlinter"]["contracts"] if each["type"] == "layers"]
    height = {
        name.strip().removeprefix("cellwright."): index
        for index, layer in enumerate(reversed(layers))
        for name in re.split(r"[|:]", layer)
    }
    rooms = [name.removesuffix(".py") for row in ROWS for name in re.findall(r"`([\w.]+)`", row)]
    heights = [height[name] for name in rooms if name in height]
    assert heights == sorted(heights)
    assert len(heights) == len(height)
