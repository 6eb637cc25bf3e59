"""Sensors of a cell: places by relation, and refusals."""

import math
from pathlib import Path

import pytest

from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose

CELL = """cell:
  frame: {{at: {at}, turn: {turn}}}
  bins: {{bin1: {{at: [1, 0], size: [0.4, 0.3], surface: 0.7}}}}
  belts: {{belt: {{from: [0, 2], to: [0, -2], width: 0.4, surface: 0.6}}}}
  trays: {{tray1: {{at: [2, 0]}}}}
  sensors:
    {sensor}
"""


def sensor(text: str, at: str = "[0, 0]", turn: str = "0") -> SensorConfig:
    """Return the one sensor of a cell."""
    loaded = load_trial(text=CELL.format(sensor=text, at=at, turn=turn))
    assert loaded.warnings == ()
    (found,) = loaded.trial.sensors
    return found


def direction(pose: Pose) -> tuple[float, float, float]:
    """Return where a sensor looks."""
    return pose.rotate((1.0, 0.0, 0.0))


def test_camera_over_a_bin_looks_down_with_its_wide_side_along_the_longer_edge() -> None:
    pose = sensor("logical_camera_1: {type: logical_camera, over: bin1, height: 0.5}").pose
    assert pose.position == pytest.approx((1.0, 0.0, 1.2))
    assert direction(pose) == pytest.approx((0.0, 0.0, -1.0))
    assert [abs(each) for each in pose.rotate((0.0, 1.0, 0.0))] == pytest.approx([1.0, 0.0, 0.0])


def test_camera_over_a_tray_is_wide_along_its_length() -> None:
    pose = sensor("logical_camera_1: {type: logical_camera, over: tray1, height: 0.5}").pose
    assert [abs(each) for each in pose.rotate((0.0, 1.0, 0.0))] == pytest.approx([0.0, 1.0, 0.0])


def test_camera_over_a_belt_is_at_a_distance_from_its_start() -> None:
    pose = sensor("logical_camera_1: {type: logical_camera, over: belt, along: 1.5, across: 0.1, height: 0.5}").pose
    assert pose.position == pytest.approx((0.1, 0.5, 1.1))


def test_beam_on_a_belt_stands_at_the_edge_and_looks_across() -> None:
    pose = sensor("beam: {type: break_beam, on: belt, along: 1}").pose
    assert pose.position == pytest.approx((0.26, 1.0, 0.603))
    assert direction(pose) == pytest.approx((-1.0, 0.0, 0.0))
    pose = sensor("beam: {type: break_beam, 'on': belt, along: 1, across: -0.3, height: 0.02}").pose
    assert pose.position == pytest.approx((-0.3, 1.0, 0.62))
    assert direction(pose) == pytest.approx((1.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "text", ["{over: bin1, height: 0.5}", "{over: belt, along: 1, height: 0.5}", "{pose: {xyz: [1, 2, 3]}}"]
)
def test_sensors_move_with_the_cell(text: str) -> None:
    text = f"logical_camera_1: {{type: logical_camera, {text[1:]}"
    by = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))
    moved, still = sensor(text, "[2, 1]", "pi/2").pose, sensor(text).pose
    assert moved.position == pytest.approx((by @ still).position)
    assert direction(moved) == pytest.approx(direction(by @ still), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: {type: break_beam}", "a: write over: NAME, on: NAME or pose: {xyz, rpy} (got none of them)"),
        ("a: {type: break_beam, on: belt, over: bin1}", "(got over and on)"),
        ("a: {type: break_been, on: belt}", "a.type: there is no sensor type 'break_been'; did you mean break_beam"),
        ("a: {type: break_beam, on: belts}", "a.on: the cell has no bin, belt or tray 'belts'; did you mean belt"),
        ("a: {type: break_beam, on: bin1}", "a.on: must name a belt; write over for a bin or a tray"),
        ("a: {type: break_beam, over: bin1}", "write height, the distance from the surface [m], beside over"),
        ("a: {type: break_beam, over: bin1, height: 1, along: 1}", "a.along: is for belts alone; leave it out"),
        ("a: {type: break_beam, on: belt, along: 5}", "a.along: must be at most the belt's length of 4 m (got 5)"),
        ("a: {type: break_beam, on: belt, turn: 1}", "a.turn: has no meaning with on; leave it out"),
        ("a: {type: break_beam, pose: {}, height: 1}", "a.height: has no meaning with pose; leave it out"),
        ("a: {type: break_beam, on: belt, hight: 1}", "a.hight: unknown entry; did you mean height"),
        ("bin1: {type: break_beam, on: belt}", "bin1: a bin, belt or tray has this name; choose another"),
        ("orders: {type: break_beam, on: belt}", "orders: the cell has a topic 'orders'; choose another name"),
        ("population/state: {type: break_beam, on: belt}", "the cell has a topic 'population/state'; choose another"),
        ("{a: {type: break_beam, on: belt}, a_change: {type: break_beam, on: belt}}", "the break beam 'a' has a topic"),
        ("a-b: {type: break_beam, on: belt}", "a-b: a sensor's name becomes a topic"),
    ],
)
def test_mistake_is_refused_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        sensor(text)
    assert any(str(each).startswith("<text>:7: ") and reason in str(each) for each in caught.value.problems)


def test_name_of_a_sensor_of_2017_is_taken() -> None:
    text = CELL.format(sensor="a: {type: break_beam, on: belt}", at="[0, 0]", turn="0")
    with pytest.raises(DescriptionError, match="a sensor of the section sensors has this name"):
        load_trial(text=text + "sensors: {a: {type: break_beam, pose: {}}}\n")


def test_base_passes_on_its_sensors_one_by_one(tmp_path: Path) -> None:
    names = "a: {type: break_beam, on: belt}\n    b: {type: break_beam, on: belt, along: 1}"
    (tmp_path / "base.yaml").write_text(CELL.format(sensor=names, at="[0, 0]", turn="0"))
    trial = tmp_path / "trial.yaml"
    trial.write_text("cell: {based_on: base.yaml, sensors: {a: null, b: {along: 3}}}\n")
    (found,) = load_trial([trial]).trial.sensors
    assert found.name == "b"
    assert found.pose.position[1] == pytest.approx(-1.0)
