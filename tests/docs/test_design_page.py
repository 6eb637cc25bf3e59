"""The table of rooms in the page on design is that of the source."""

import re
import tomllib
from pathlib import Path

import pytest

import cellwright

SOURCE = Path(cellwright.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "design.md").read_text(encoding="utf-8")
ROWS = [line.split("|")[1] for line in PAGE.splitlines() if re.match(r"\| (· )?`", line)]
NAMED = {name for row in ROWS for name in re.findall(r"`([\w/.]+)`", row)}
PROJECT = tomllib.loads((SOURCE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
CONTRACTS = {each["name"]: each for each in PROJECT["tool"]["importlinter"]["contracts"]}
"""Those of import-linter."""


def within(room: str = "") -> set[str]:
    """Rooms and files within a room."""
    folder = SOURCE.joinpath(*room.split("."))
    found = {path.parent.name for path in folder.glob("*/__init__.py")}
    found |= {path.stem for path in folder.glob("*.py")} - {"__init__", "__main__", "_package"}
    return {f"{room}.{name}".lstrip(".") for name in found}


def test_package_of_source_has_row_in_table() -> None:
    assert within() == {name for name in NAMED if "/" not in name}


def test_path_in_table_exists_in_source() -> None:
    for name in NAMED:
        assert (SOURCE / name).exists(), name


def test_order_of_table_equals_import_layers() -> None:
    """The order of the table is that of the layers, which import-linter checks, read from the bottom."""
    layers = [layer.split(" | ") for layer in CONTRACTS["Arrows between rooms run one way"]["layers"]]
    height = {name: index for index, layer in enumerate(reversed(layers)) for name in layer}
    heights = [height[row.strip(" `")] for row in ROWS if not row.startswith(" ·")]
    assert heights == sorted(heights)
    assert len(heights) == len(height)


@pytest.mark.parametrize(
    ("contract", "opened", "known"),
    [
        (
            "Bridges load nothing else of Cellwright",
            ("middleware",),
            {"middleware.wire", "middleware.ros1", "middleware.ros2"},
        ),
        (
            "A robot held by a node of ROS loads the wire and the errors alone",
            ("middleware", "clients", "util"),
            {"clients.assembled", "middleware.wire", "util.errors"},
        ),
    ],
)
def test_import_contract_forbids_all_other_packages(contract: str, opened: tuple[str, ...], known: set[str]) -> None:
    rooms = (within() - set(opened)).union(*map(within, opened)) - known
    for ros in known & {"middleware.ros1", "middleware.ros2"}:
        rooms |= within(ros) - {f"{ros}.bridge"}
    forbidden = {name for name in CONTRACTS[contract]["forbidden_modules"] if name.startswith("cellwright.")}
    assert forbidden == {f"cellwright.{name}" for name in rooms}
