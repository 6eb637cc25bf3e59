"""Maps of cells."""

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.colors import to_hex

import cellwright
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import UsageError
from cellwright.viewer.cell_map import PART, _Map, draw_map
from tests.cell.arm_cells import TWO_ON_A_RAIL, ur5_cell
from tests.cell.checks.odd import SMALL, camera_over, trial_with
from tests.support.places import LAYOUT


def texts(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_map_names_everything(tmp_path: Path) -> None:
    file = tmp_path / "cell.svg"
    draw_map(cellwright.load_trial("lesson"), file)
    drawn = texts(file)
    assert all(name in drawn for name in ("bin1", "bin8", "belt", "agv1", "agv2"))
    assert all(each.name in drawn for each in LAYOUT.structure)
    assert "1 m" in drawn
    assert "rail of the arm" in drawn
    assert "out of reach" in drawn


@pytest.mark.slow
def test_map_of_an_own_cell_has_its_trays_and_views(tmp_path: Path) -> None:
    file = tmp_path / "cell.svg"
    draw_map(trial_with(SMALL, camera_over("logical_camera_left", -0.4, 0.5, 1.3)), file)
    drawn = texts(file)
    assert all(name in drawn for name in ("left", "right", "table", "camera_left", "view of a logical camera"))
    assert "path of an AGV" not in drawn


@pytest.mark.slow
def test_names_of_bins_and_cameras_cover_no_parts(tmp_path: Path) -> None:
    trial = cellwright.load_trial(find_trial("final01"), find_trial("kitter_sensors"))
    figure = _Map(trial).draw()
    figure.savefig(tmp_path / "cell.png", dpi=100)
    (axes,) = figure.axes
    parts = [each.get_window_extent() for each in axes.patches if to_hex(each.get_facecolor()) == PART]
    names = [each for each in axes.texts if each.get_text().startswith(("bin", "camera_"))]
    assert len(parts) > 20
    assert len(names) > 12
    for name in names:
        box = name.get_window_extent()
        assert not [part for part in parts if box.overlaps(part)], name


@pytest.mark.slow
def test_arm_on_a_pedestal_has_one_name_that_covers_no_other(tmp_path: Path) -> None:
    figure = _Map(ur5_cell()).draw()
    figure.savefig(tmp_path / "cell.png", dpi=100)
    (axes,) = figure.axes
    names = {each.get_text(): each.get_window_extent() for each in axes.texts if each.get_text()}
    assert {"arm", "bin1", "tray1"} <= names.keys()
    assert "arm_pedestal" not in names
    assert not [name for name, box in names.items() if name != "arm" and box.overlaps(names["arm"])]


@pytest.mark.slow
def test_rails_of_several_arms_have_their_names(tmp_path: Path) -> None:
    file = tmp_path / "cell.svg"
    draw_map(load_trial(text=TWO_ON_A_RAIL).trial, file)
    assert all(f"rail of arm{number}" in texts(file) for number in (1, 2))


@pytest.mark.slow
def test_map_of_an_empty_cell_is_drawn(tmp_path: Path) -> None:
    file = tmp_path / "cell.png"
    draw_map(trial_with(replace(SMALL, bins=(), trays=()), has_arm=False), file)
    assert file.read_bytes().startswith(b"\x89PNG")


def test_map_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match=r"cell.pdf: a map is a PNG or SVG file; give a name that ends in .png or .svg"
    ):
        draw_map(trial_with(SMALL), tmp_path / "cell.pdf")
