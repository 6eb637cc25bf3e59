"""Command `cellwright cell reach`."""

import json
from pathlib import Path

import pytest

from tests.cell.arm_cells import ARMS, PEDESTAL
from tests.cli.conftest import CommandLine


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "ur5.yaml"
    text = PEDESTAL.replace("bins: {{", "bins: {{far: {{at: [-0.1, 1.3], size: [0.5, 0.6], surface: 0.45}}, ")
    file.write_text(text.format(model=ARMS / "ur5.urdf"))
    return file


def test_table_has_a_row_for_each_arm_and_place(file: Path, cellwright: CommandLine) -> None:
    ran = cellwright("cell", "reach", str(file))
    assert ran.status == 0
    heading, _, far, bin1, tray = ran.out.splitlines()
    assert heading.split("   ") == ["arm", "place", "in reach", "clear", "singular [m]", "limit [rad]"]
    assert far.split() == ["arm", "far", "0", "%", "0", "%", "-", "-"]
    assert bin1.split()[:-2] == ["arm", "bin1", "100", "%", "100", "%"]
    assert tray.split()[:-2] == ["arm", "tray1", "100", "%", "100", "%"]
    assert f"warning: {file}:9: cell.bins.far: out of reach of the arm, tool down; move it nearer" in ran.err


def test_json_has_shares_margins_and_points(file: Path, cellwright: CommandLine) -> None:
    ran = cellwright("cell", "reach", str(file), "--json")
    assert ran.status == 0
    document = json.loads(ran.out)
    assert (document["trial"], document["spacing"], document["height"]) == ("ur5", 0.05, 0.02)
    places = document["arms"]["arm"]
    assert [*places] == ["far", "bin1", "tray1"]
    assert places["far"] == {
        "kind": "bins",
        "in_reach": 0.0,
        "clear": 0.0,
        "singular": None,
        "limit": None,
        "points": ["." * 12] * 10,
    }
    assert places["tray1"]["points"] == ["#" * 8] * 10
    assert places["tray1"]["singular"] == pytest.approx(0.096, abs=0.002)


def test_picture_shows_the_reach(file: Path, cellwright: CommandLine, tmp_path: Path) -> None:
    picture = tmp_path / "reach.svg"
    ran = cellwright("cell", "reach", str(file), "--picture", str(picture))
    assert ran.status == 0
    drawn = picture.read_text()
    assert all(words in drawn for words in ("in reach and clear", "out of reach, tool down", "tray1"))
    assert "arm touches something" not in drawn


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("final01",), "error: final01: the cell has no arm; add the section `arm`, or a file that has it\n"),
        (("lesson", "--picture", "cell.pdf"), "cell.pdf: a map is a PNG or SVG file"),
        (("lesson", "--picture", "no/cell.svg"), "--picture no/cell.svg: there is no folder no"),
        (("no.yaml",), "no.yaml: there is no such file"),
    ],
)
def test_what_cannot_be_measured_is_refused(words: tuple[str, ...], message: str, cellwright: CommandLine) -> None:
    ran = cellwright("cell", "reach", *words)
    assert ran.status == 2
    assert message in ran.err
