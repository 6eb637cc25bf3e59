"""The table of rooms in the page on design is that of the source."""

import re
import tomllib
from pathlib import Path

import pytest

import cellwright

SOURCE = Path(cellwright.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "design.md").read_text(encoding="utf-8")
ROWS = [line.split("|")[1] for line in PAGE.splitlines() if re.match(r"\| (· )?`", line)]
ROOMS = {f"cellwright.{path.parent.name}" for path in SOURCE.glob("*/__init__.py")} | {
    f"cellwright.{path.stem}" for path in SOURCE.glob("[a-z]*.py")
}
TOLD = {name for row in ROWS for name in re.findall(r"`([\w/.]+)`", row)}
CONTRACTS = {
    each["name"]: each
    for each in tomllib.loads((SOURCE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "importlinter"
    ]["contracts"]
}
"""Those of import-linter."""


def test_every_room_has_its_row() -> None:
    rooms = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    files = {path.name for path in SOURCE.glob("*.py")} - {"__init__.py"}
    assert rooms | files == {name for name in TOLD if "/" not in name}


def test_what_is_told_of_rooms_within_rooms_is_there() -> None:
    for name in TOLD:
        assert (SOURCE / name).exists(), name


def test_an_arrow_runs_from_a_room_to_those_above_it_in_the_table() -> None:
    """The order of the table is that of the layers, which import-linter checks, read from the bottom."""
    layers = CONTRACTS["Arrows between rooms run one way"]["layers"]
    height = {
        name.strip().removeprefix("cellwright."): index
        for index, layer in enumerate(reversed(layers))
        for name in re.split(r"[|:]", layer)
    }
    rooms = [name.removesuffix(".py") for row in ROWS for name in re.findall(r"`([\w.]+)`", row)]
    heights = [height[name] for name in rooms if name in height]
    assert heights == sorted(heights)
    assert len(heights) == len(height)


def test_every_room_stands_in_a_layer() -> None:
    layers = CONTRACTS["Arrows between rooms run one way"]["layers"]
    named = {name.strip() for layer in layers for name in layer.split("|")}
    assert named == ROOMS - {"cellwright.bridges"}  # which is loaded by other interpreters, and knows the link alone


@pytest.mark.parametrize(
    ("contract", "known"),
    [
        ("What bridges load knows nothing else of Cellwright", {"link", "bridges"}),
        ("What a node of ROS loads knows the link and the errors alone", {"assembled", "link", "errors"}),
    ],
)
def test_what_knows_few_rooms_is_kept_from_all_others(contract: str, known: set[str]) -> None:
    forbidden = {name for name in CONTRACTS[contract]["forbidden_modules"] if name.startswith("cellwright.")}
    assert forbidden == ROOMS - {f"cellwright.{name}" for name in known}
