"""Reader of cells: values, defaults, and a refusal for each mistake."""

import math
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.layout import keys
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Layout, Tray
from cellwright.config.layout.reader import Cell, read_cell
from cellwright.config.layout.surroundings import Block, FloorLine, Place, View
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.sources import JoinedText, Text
from cellwright.config.parsing.tree import Problems
from cellwright.config.parsing.yaml_source import parse_mapping
from cellwright.util.pose import Pose


def read(text: str) -> tuple[Cell | None, list[str], list[str]]:
    """Return the cell, its errors and its warnings."""
    problems = Problems()
    root = parse_mapping(JoinedText([Text("cell.yaml", text)]), problems, "")
    cell = read_cell(root, Reader(problems), {"gear_part"})
    return cell, [str(each) for each in problems.errors], [str(each) for each in problems.warnings]


def layout(text: str) -> Layout:
    """Return the layout of a valid cell."""
    cell, errors, _ = read(text)
    assert not errors
    assert cell is not None
    return cell.layout


def test_bin_has_its_place_turn_and_size() -> None:
    (found,) = layout("bins: {small: {at: [1, 0.5], turn: pi/2, size: [0.4, 0.3], surface: 0.5}}").bins
    assert found.name == "small"
    assert found.pose.position == (1.0, 0.5, 0.0)
    assert found.pose.yaw == pytest.approx(math.pi / 2)
    assert found.link == found.pose
    assert (found.size, found.surface, found.grid_height, found.frame_height) == ((0.4, 0.3), 0.5, 0.525, 0.495)


def test_half_is_a_half_and_not_zero_as_in_trials_of_2017() -> None:
    assert layout("bins: {a: {at: [1/2, 0]}}").bins[0].centre == (0.5, 0.0)


def test_belt_goes_from_start_to_end() -> None:
    (belt,) = layout("belts: {belt: {from: [1, 2], to: [1, -2], width: 0.4, surface: 0.6, speed: 0.1}}").belts
    assert belt.body == "conveyor_belt"
    assert belt.direction == (0.0, -1.0, 0.0)
    assert belt.size[:2] == (4.0, 0.4)
    assert belt.surface == pytest.approx(0.6)
    assert belt.speed == 0.1
    assert belt.spawn.position == pytest.approx((1.0, 1.7, belt.centre.position[2]))
    assert belt.wall is not None
    assert belt.wall.position == pytest.approx((1.0, -1.8, 1.1))
    assert belt.wall.rotate((1.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))
    assert belt.frame.position == pytest.approx((1.0, 0.0, 0.6))


def test_belt_with_a_drop_has_no_wall() -> None:
    (belt,) = layout("belts: {belt: {from: [1, 2], to: [1, -2], ends: drop}}").belts
    assert belt.wall is None
    assert belt.exit == belt.end == pytest.approx(2.0)
    (walled,) = layout("belts: {belt: {from: [1, 2], to: [1, -2], ends: wall}}").belts
    assert walled.exit == pytest.approx(1.8)


def test_belt_of_another_name_has_a_body_of_its_own() -> None:
    (belt,) = layout("belts: {side: {at: [0, 0], length: 2}}").belts
    assert (belt.body, belt.direction, belt.size[0]) == ("conveyor_side", (1.0, 0.0, 0.0), 2.0)


def test_carrier_has_tray_sensor_and_way_of_2017_from_its_station() -> None:
    (agv,) = layout("carriers: {cart: {at: [0.3, -3.3], colour: '#ff0000'}}").carriers
    known = gear2017().carrier("agv2")
    assert (agv.number, agv.tray_link) == (1, "cart::kit_tray_1::kit_tray_1::tray")
    assert agv.tray_frame.position == pytest.approx(known.tray_frame.position)
    assert agv.quality.position == pytest.approx(known.quality.position)
    assert agv.out == (("0", 0.3, -3.3), ("10", 0.3, -8.3))
    assert agv.back == (("0", 0.3, -8.3), ("10", 0.3, -3.3))
    assert agv.colour == (1.0, 0.0, 0.0, 1.0)


def test_longer_tray_of_a_carrier_reaches_further_to_its_front() -> None:
    (agv,) = layout("carriers: {cart: {at: [1, 0], turn: pi, tray: [0.4, 1.1]}}").carriers
    (usual,) = layout("carriers: {cart: {at: [1, 0], turn: pi}}").carriers
    assert agv.plate == (0.4, 1.1)
    assert agv.tray_frame.position == pytest.approx((1.0, -0.35, 0.75))
    assert agv.tray_surface.position == pytest.approx((1.0, -0.35, 0.755))
    assert agv.covers(1.0, -0.89)
    assert not usual.covers(1.0, -0.89)
    # both begin at the mast, and in both the sensor over the tray sees all of it
    for each in (agv, usual):
        back, front = (each.tray_frame.transform((0.0, side * each.plate[1] / 2, 0.0))[1] for side in (-1, 1))
        assert back == pytest.approx(0.2)
        assert each.quality.position[1] - 0.78 < front
        assert back < each.quality.position[1] + 0.78


def test_agv_keeps_the_number_in_its_name() -> None:
    found = layout("carriers: {cart: {at: [0, 0]}, agv1: {at: [3, 0]}, other: {at: [6, 0]}, agv4: {at: [9, 0]}}")
    assert [(each.name, each.number) for each in found.carriers] == [
        ("cart", 2),
        ("agv1", 1),
        ("other", 3),
        ("agv4", 4),
    ]


def test_arm_stands_on_its_rail() -> None:
    cell, _, _ = read("arms: {arm: {mount: {kind: rail, at: [1, 2], turn: pi/2}}}")
    assert cell is not None
    assert cell.has_arm
    assert cell.layout.arms[0].pose.position == (1.0, 2.0, 0.9)
    assert cell.layout.arms[0].pose.yaw == pytest.approx(math.pi / 2)


def test_tray_has_a_number_after_those_of_the_carriers() -> None:
    found = layout(
        "trays: {tray1: {at: [1, 0], turn: 1, size: [0.4, 0.6], surface: 0.8, rim: 0}}\ncarriers: {agv2: {at: [5, 5]}}"
    )
    assert found.trays == (Tray(3, "tray1", Pose.from_rpy((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.4, 0.6), 0.8, 0.0),)
    assert [each.number for each in layout("trays: {a: {at: [1, 0]}, b: {at: [2, 0]}}").trays] == [1, 2]


def test_structure_stands_in_its_frame() -> None:
    post = "{at: [0, 0, 1], size: [0.1, 0.2, 2]}"
    text = (
        f"structure: {{post: {{frame: {{at: [1, 0], turn: pi/2}}, at: [2, 0, 0], boxes: [{post}], drawn: [{post}]}}}}"
    )
    (found,) = layout(text).structure
    assert found.pose.position == pytest.approx((1.0, 2.0, 0.0))
    assert found.boxes == found.drawn == (Block(Pose((0.0, 0.0, 1.0)), (0.1, 0.2, 2.0)),)


def test_lines_views_and_places_are_read() -> None:
    found = layout(
        "{floor_lines: [{at: [1, 2], size: [3, 0.1]}], views: {side: {at: [1, 2, 3], to: [0, 0, 1], angle: 1}},"
        " places: {aside: {at: [1, 2, 0.8], turn: 1}}}"
    )
    assert found.floor_lines == (FloorLine(Pose((1.0, 2.0, 0.0)), (3.0, 0.1)),)
    assert found.views == (View("side", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0), 1.0),)
    assert found.places == (Place("aside", Pose.from_rpy((1.0, 2.0, 0.8), (0.0, 0.0, 1.0))),)


def test_bin_has_walls_and_open_sides() -> None:
    (found,) = layout("bins: {a: {at: [0, 0], walls: 0.1, open: [+y], gap: 0.01}}").bins
    assert (found.walls, found.open, found.gap) == (0.1, ("+y",), 0.01)


def test_layout_is_in_frame_of_cell() -> None:
    cell, _, _ = read("{based_on: gear2017, frame: {at: [2, 1], turn: pi/2}}")
    assert cell is not None
    assert cell.layout == gear2017()
    assert cell.layout.moved(cell.moved_by).bin("bin7").centre == pytest.approx((1.77, 0.7))


def test_cell_of_2017_alone_is_equal_and_has_no_arm_of_its_own() -> None:
    cell, _, warnings = read("based_on: gear2017")
    assert cell is not None
    assert cell.layout == gear2017()
    assert (cell.has_arm, warnings) == (False, [])


def test_cell_without_anything_is_warned_of() -> None:
    for text in ("{}", "frame: {at: [1, 1]}"):
        _, errors, (warning,) = read(text)
        assert not errors
        assert "based_on: gear2017" in warning


REFUSALS = {
    "bind: {}": "1: bind: unknown entry; did you mean bins",
    "bins:": "1: bins: must be a mapping (got an empty value); write {} for none, or leave the entry out",
    "bins: {a: 1}": "1: bins.a: must be a mapping (got the number 1)",
    "bins: {a: {}}": "1: bins.a: the required entry 'at' is missing",
    "bins: {a: {at: [1, 2, 3]}}": "1: bins.a.at: must be [x, y] (got a list of 3)",
    "bins: {a: {at: [1, left]}}": "1: bins.a.at[1]: 'left' uses 'left', which is not in Python's math module",
    "bins: {a: {at: [1, true]}}": "1: bins.a.at[1]: must be a number or an expression such as pi/2 (got the boolean",
    "bins: {a: {at: [1, 200]}}": "1: bins.a.at[1]: must be from -100 to 100 m (got 200)",
    "bins: {a: {at: [1, .nan]}}": "1: bins.a.at[1]: must be a finite number",
    "bins: {a: {at: [1, 2], turn: 90}}": "1: bins.a.turn: must be from -10 to 10 rad (got 90)",
    "bins: {a: {at: [1, 2], size: [0, 1]}}": "1: bins.a.size[0]: must be from 0.05 to 20 m (got 0)",
    "bins: {a: {at: [1, 2], size: [-1, 1]}}": "1: bins.a.size[0]: must be from 0.05 to 20 m (got -1)",
    "bins: {a: {at: [1, 2], surface: 0}}": "1: bins.a.surface: must be from 0.05 to 5 m (got 0)",
    "bins: {a: {at: [1, 2], sice: [1, 1]}}": "1: bins.a.sice: unknown entry; did you mean size",
    "bins: {1: {at: [1, 2]}}": "1: bins.1: must be a name (got the number 1); put it in quotes to use it as one",
    "bins: {my-bin: {at: [1, 2]}}": "1: bins.my-bin: a name becomes topics and frames; use at most 60 letters, digit",
    "bins: {world: {at: [1, 2]}}": "1: bins.world: the cell has something else called 'world'; choose another name",
    "bins: {base_link: {at: [1, 2]}}": "1: bins.base_link: the cell has something else called 'base_link'; choose an",
    "bins: {arm: {at: [1, 2]}}": "1: bins.arm: the cell has something else called 'arm'; choose another name",
    "bins: {kit_tray_3: {at: [1, 2]}}": "1: bins.kit_tray_3: the cell has something else called 'kit_tray_3'; choose",
    "bins: {gear_part: {at: [1, 2]}}": "1: bins.gear_part: a part type has this name; choose another",
    "bins: {a: {at: [1, 2]}}\nbelts: {a: {at: [0, 0], length: 2}}": "2: belts.a: bins.a has this name (cell.yaml:1);",
    "belts: {a: {}}": "1: belts.a: the required entry 'from' is missing; a belt has from and to, or at, turn and len",
    "belts: {a: {from: [0, 0]}}": "1: belts.a: the required entry 'to' is missing; a belt has from and to, or at, tu",
    "belts: {a: {from: [0, 0], to: [1, 0], turn: 1}}": "1: belts.a: write from and to, or at, turn and length (got f",
    "belts: {a: {from: [0, 0], to: [0, 0]}}": "1: belts.a: must be from 0.5 to 60 m long (got 0, from start to end)",
    "belts: {a: {at: [0, 0], length: 0}}": "1: belts.a.length: must be from 0.5 to 60 m (got 0)",
    "belts: {a: {at: [0, 0], length: 1, speed: 0}}": "1: belts.a.speed: must be from 0.01 to 2 m/s (got 0)",
    "belts: {a: {at: [0, 0], length: 1, wall: {}}}": "1: belts.a.wall: the required entry 'at' is missing",
    "belts: {a: {at: [0, 0], length: 1, ends: floor}}": "1: belts.a.ends: unknown end of a belt 'floor' (known: wall",
    "belts: {a: {at: [0, 0], length: 1, ends: drop, wall: {at: [0, 0, 1]}}}": "1: belts.a.wall: parts drop off this b",
    "carriers: {a: {at: [0, 0], tray: [0.6, 0.7]}}": "1: carriers.a.tray: must be at most 0.54 x 1.4 m, which the qual",
    "carriers: {a: {at: [0, 0], tray: 1}}": "1: carriers.a.tray: must be [x, y]",
    "carriers: {a: {at: [0, 0], colour: red}}": "1: carriers.a.colour: must be a colour in quotes such as '#e0762b'",
    "carriers: {a: {at: [0, 0], path: {out: [], back: []}}}": "1: carriers.a.path.out: must be a list of 2 to 100 ke",
    "carriers: {a: {at: [0, 0], path: {out: [[0, 0, 0], [0, 1, 1]], back: [[0, 1, 1], [5, 0, 0]]}}}": "1: "
    "carriers.a.path.out: times must ascend from 0 by at least 0.1 s (got 0, 0)",
    "carriers: {a: {at: [0, 0], path: {out: [[0, 1, 0], [5, 1, 1]], back: [[0, 1, 1], [5, 0, 0]]}}}": "1: "
    "carriers.a.path: the way out must begin at the station, [0, 0] (got [1, 0])",
    "carriers: {a: {at: [0, 0], path: {out: [[0, 0, 0], [5, 1, 1]], back: [[0, 1, 2], [5, 0, 0]]}}}": "1: "
    "carriers.a.path: the way back must begin where the way out ends, [1, 1] (got [1, 2])",
    "carriers: {a: {at: [0, 0], path: {out: [[0, 0, 0], [5, 1, 1]], back: [[0, 1, 1], [5, 3, 0]]}}}": "1: "
    "carriers.a.path: the way back must end at the station, [0, 0] (got [3, 0])",
    "arms: {arm: {mount: {kind: floor, at: [0, 0]}}}": "1: arms.arm.mount: without a model the arm is a UR10",
    "arms: {arm: {mount: {kind: wall, at: [0, 0]}}}": "1: arms.arm.mount.kind: unknown kind of mount 'wall' (known",
    "arms: {a: {mount: {kind: rail, at: [0, 0]}}, b: {mount: {kind: rail, at: [1, 0]}, namespace: a}}": "1: "
    "arms.b.namespace: a has this namespace",
    "arm_clearance: 0.1": "1: arm_clearance: the cell has no two arms, nor an arm and a robot; leave it out",
    "frame: {turn: 1}": "1: frame: the required entry 'at' is missing",
    "bins: {a: {at: [1, 2], open: [y]}}": "1: bins.a.open: must be a list of +x, -x, +y, -y",
    "bins: {a: {at: [1, 2], open: [+y, +y]}}": "1: bins.a.open: must be a list of +x, -x, +y, -y (got a list)",
    "trays: {a: {at: [1, 2], size: [1, 0]}}": "1: trays.a.size[1]: must be from 0.05 to 20 m (got 0)",
    "structure: {a: {at: [1, 2, 0], boxes: 1}}": "1: structure.a.boxes: must be a list of at most 100 mappings",
    "structure: {a: {at: [1, 2, 0], boxes: [{}]}}": "1: structure.a.boxes[0]: the required entry 'at' is missing",
    "bins: {a: {at: [1, 2]}}\nstructure: {a: {at: [1, 2, 0], boxes: []}}": "2: structure.a: bins.a has this name",
    "views: {a: {at: [1, 2, 0], to: [1, 2]}}": "1: views.a.to: must be [x, y, z] (got a list of 2)",
    "shelf: 3": "1: shelf: must be [x, y] (got the number 3)",
}


@pytest.mark.parametrize("text", REFUSALS)
def test_mistake_is_refused_with_its_place(text: str) -> None:
    _, errors, _ = read(text)
    assert [error for error in errors if error.startswith(f"cell.yaml:{REFUSALS[text]}")], errors


def test_all_mistakes_are_listed_at_once() -> None:
    cell, errors, _ = read("bins: {a: {at: 1}, b: {at: [1, 2], sice: 1}}\nbelts: {c: {}}\nshelf: 1")
    assert len(errors) == 4
    assert cell is not None
    assert cell.refused == {"a", "c"}


def test_number_of_entries_is_bounded() -> None:
    _, (error,), _ = read(yaml.safe_dump({"bins": {f"bin{n}": {"at": [n % 90, 0]} for n in range(101)}}))
    assert error.endswith("bins: too many entries (got 101, at most 100)")


SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-5, 5), st.floats(-9.0, 9.0), st.sampled_from(["pi/2", "red", "rail", "bin1"])
)
WORDS = st.sampled_from(
    [
        *keys.CELL.names,
        *keys.BIN.names,
        *keys.BELT.names,
        *keys.CARRIER.names,
        *keys.MOUNT.names,
        *("mount", "out", "back", "bin1", "agv1", "belt", "arm", "a", "b"),
    ]
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(WORDS, inner, max_size=4)),
    max_leaves=12,
)
PLACES = st.lists(st.integers(-9, 9), min_size=2, max_size=2)
BINS = st.dictionaries(
    st.sampled_from(["bin1", "a", "b"]), st.fixed_dictionaries({"at": PLACES}, optional={"size": VALUES})
)


@given(st.dictionaries(WORDS, st.one_of(VALUES, BINS), max_size=5), st.sampled_from(["empty", "gear2017"]))
def test_any_mapping_is_refused_with_a_line_or_a_layout(cell: dict[str, Any], base: str) -> None:
    text = yaml.safe_dump({**cell, "based_on": base})
    found, errors, _ = read(text)
    assert errors or isinstance(found, Cell)
    assert all(error.startswith(("cell.yaml:", "<gear2017>:")) for error in errors)
    if found is not None and not errors:
        assert found.layout == layout(text)
