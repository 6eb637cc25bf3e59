"""Cells that are based on others: order, changes, what is taken away, and files."""

from pathlib import Path

import pytest

from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Layout
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError


def layout(text: str) -> Layout:
    """Return the layout of a cell that changes the one of 2017."""
    return load_trial(text=f"cell: {{based_on: gear2017, {text}}}").trial.layout


def errors(text: str) -> list[str]:
    """Return the errors of a cell that changes the one of 2017."""
    with pytest.raises(DescriptionError) as caught:
        layout(text)
    return [str(problem) for problem in caught.value.problems]


def test_entry_is_changed_in_its_place_and_new_ones_follow() -> None:
    found = layout("bins: {new: {at: [3, 3]}, bin2: {surface: 0.9}}")
    assert [each.name for each in found.bins] == [*(f"bin{n}" for n in range(1, 9)), "new"]
    assert found.bins[1].surface == 0.9
    assert found.bins[1].link == gear2017().bins[1].link
    assert found.bins[2:8] == gear2017().bins[2:8]


def test_empty_value_takes_an_entry_away() -> None:
    found = layout("bins: {bin1: null, bin3: null}")
    assert [each.name for each in found.bins] == ["bin2", "bin4", "bin5", "bin6", "bin7", "bin8"]


def test_empty_section_takes_all_away() -> None:
    found = layout("belts: {}, carriers: {}")
    assert (found.belts, found.carriers, found.bins) == ((), (), gear2017().bins)


def test_remaining_agv_keeps_its_number() -> None:
    assert layout("carriers: {agv1: null}").carriers == gear2017().carriers[1:]


def test_moved_belt_takes_along_what_belongs_to_it() -> None:
    (belt,) = layout("belts: {belt: {from: [3, 2], to: [3, -2]}}").belts
    assert belt.size == (4.0, *gear2017().belts[0].size[1:])
    assert belt.covers(*belt.spawn.position[:2])
    assert belt.wall is not None
    assert belt.covers(*belt.wall.position[:2])


def test_end_of_belt_replaces_that_of_the_base() -> None:
    assert layout("belts: {belt: {ends: drop}}").belts[0].wall is None
    assert layout("belts: {belt: {wall: {at: [1.2, -4, 1.4]}}}").belts[0].wall is not None


def test_wall_replaces_the_drop_of_the_base(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("cell: {belts: {belt: {from: [0, 0], to: [0, 4], ends: drop}}}")
    changed = tmp_path / "own.yaml"
    changed.write_text("cell: {based_on: base.yaml, belts: {belt: {wall: {at: [0, 3.5, 1.4]}}}}")
    wall = load_trial([changed]).trial.layout.belt("belt").wall
    assert wall is not None
    assert wall.position == (0.0, 3.5, 1.4)


def test_moved_carrier_takes_along_tray_sensor_and_way() -> None:
    agv = layout("carriers: {agv2: {at: [2, -3.3]}}").carrier("agv2")
    assert agv.tray_frame.position == pytest.approx((2.0, -3.15, 0.75))
    assert agv.out[0][1:] == (2.0, -3.3)
    assert agv.colour == gear2017().carrier("agv2").colour


def test_empty_value_in_an_entry_takes_back_the_default() -> None:
    assert layout("belts: {belt: {speed: null}}").belts[0].speed == 0.2
    assert len(layout("carriers: {agv1: {path: null}}").carriers[0].out) == 2


def test_taking_away_what_is_not_there_is_refused() -> None:
    assert errors("bins: {bin9: null}") == [
        "<text>:1: cell.bins.bin9: the base has no 'bin9' to take away; did you mean bin8"
    ]
    assert errors("bins: {bin1: {colour: null}}")[0].startswith("<text>:1: cell.bins.bin1.colour: the base has no")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("gear2018", "unknown cell 'gear2018', and no path of a .yaml file; did you mean gear2017"),
        ("[1]", "must be empty, gear2017 or the path of a file (got a list)"),
        ("missing.yaml", "missing.yaml: cannot be read: No such file or directory"),
    ],
)
def test_unknown_base_is_refused(value: str, reason: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_trial(text=f"cell: {{based_on: {value}}}")
    assert [str(problem) for problem in caught.value.problems] == [f"<text>:1: cell.based_on: {reason}"]


def test_base_in_another_folder_is_found_from_the_file_that_names_it(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "base.yaml").write_text("cell: {bins: {a: {at: [1, 1]}, b: {at: [2, 2]}}}\norders: {}\n")
    (tmp_path / "cells" / "middle.yaml").write_text("cell: {based_on: base.yaml, bins: {b: {turn: 1}}}\n")
    trial = tmp_path / "trial.yaml"
    trial.write_text("cell: {based_on: cells/middle.yaml, bins: {a: null, c: {at: [3, 3]}}}\n")
    found = load_trial([trial]).trial.layout
    assert [(each.name, each.pose.yaw) for each in found.bins] == [("b", pytest.approx(1.0)), ("c", 0.0)]


def test_mistake_in_the_base_is_reported_in_its_file(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("cell:\n  bins: {a: {at: [1, 1], size: 2}}\n")
    (tmp_path / "trial.yaml").write_text("cell: {based_on: base.yaml}\n")
    with pytest.raises(DescriptionError) as caught:
        load_trial([tmp_path / "trial.yaml"])
    assert [str(each) for each in caught.value.problems] == [
        f"{tmp_path / 'base.yaml'}:2: cell.bins.a.size: must be [x, y] (got the number 2)"
    ]


def test_cell_based_on_itself_is_refused(tmp_path: Path) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{name}.yaml").write_text(f"cell: {{based_on: {other}.yaml}}\n")
    with pytest.raises(DescriptionError, match="is based on itself; name another cell"):
        load_trial([tmp_path / "a.yaml"])


def test_file_without_a_cell_is_refused(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("orders: {}\n")
    (tmp_path / "trial.yaml").write_text("cell: {based_on: base.yaml}\n")
    with pytest.raises(DescriptionError, match=r"base\.yaml has no section cell"):
        load_trial([tmp_path / "trial.yaml"])


def test_views_of_what_is_changed_are_computed_and_others_stay() -> None:
    def names(text: str) -> list[str]:
        return [view.name for view in layout(text).views]

    assert names("frame: {at: [1, 0]}") == ["overview", "bins", "agv1", "agv2", "belt"]
    assert names("bins: {bin9: {at: [3, 3]}}") == ["agv1", "agv2", "belt"]
    assert names("carriers: {agv2: null}") == ["bins", "agv1", "belt"]
    assert names("belts: {}, carriers: {}") == ["bins"]
    assert names("bins: {}, views: {bins: {at: [3, 3, 3], to: [0, 0, 0]}}") == ["agv1", "agv2", "belt", "bins"]
