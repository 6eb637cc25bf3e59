from dataclasses import replace

import pytest

from cellwright import load_trial
from cellwright.cell.interface import occurrence
from cellwright.config.layout.layout import Tray
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.robot_cells import tandem_cell
from tests.support.places import BELT, LAYOUT

SENSORS = """
sensors:
  beam: {type: break_beam, pose: {xyz: [1.6, 2.2, 0.9]}}
  logical_camera_1: {type: logical_camera, pose: {xyz: [-0.3, 0.4, 1.6]}}
"""


def trial(text: str) -> Trial:
    return load_trial(text=text)


def test_row_for_each_sensor_occurs_for_those_of_its_type() -> None:
    both = trial(SENSORS)
    assert occurrence.EACH_BREAK_BEAM.subjects(both) == ["beam"]
    assert occurrence.EACH_LOGICAL_CAMERA.subjects(both) == ["logical_camera_1"]
    assert occurrence.EACH_PROXIMITY_SENSOR.subjects(both) == []


@pytest.mark.parametrize(
    ("text", "agvs", "cameras"), [("{}", ("agv1", "agv2"), True), ("options: {insert_agvs: false}", (), False)]
)
def test_agvs_bring_their_rows_and_quality_sensors(text: str, agvs: tuple[str, ...], cameras: bool) -> None:
    assert tuple(occurrence.EACH_AGV.subjects(trial(text))) == agvs
    assert bool([*occurrence.WITH_TRAYS.subjects(trial(text))]) is bool(agvs)
    assert bool([*occurrence.WITH_CAMERAS.subjects(trial(text))]) is cameras


def test_arm_and_belt_parts_bring_their_rows() -> None:
    lesson = load_trial("lesson")
    assert [*occurrence.WITH_ARM.subjects(lesson)]
    assert not [*occurrence.WITH_ARM.subjects(trial("{}"))]
    assert not [*occurrence.WITH_ROBOTS.subjects(lesson)]
    assert [*occurrence.WITH_ROBOTS.subjects(tandem_cell())]
    assert not [*occurrence.WITH_BELT_PARTS.subjects(trial("{}"))]


def test_rows_of_belts_name_them_only_where_there_are_several() -> None:
    lesson = load_trial("lesson")
    second = replace(BELT, name="second", body="second")
    several = replace(lesson, layout=replace(LAYOUT, belts=(BELT, second)))
    none = replace(lesson, layout=replace(LAYOUT, belts=()), belt_parts=())
    assert [*occurrence.WITH_BELT.subjects(lesson)] == [None]
    assert occurrence.EACH_BELT.subjects(lesson) == []
    assert occurrence.EACH_BELT.subjects(several) == ["belt", "second"]
    assert occurrence.EACH_FLOW.subjects(several) == ["belt"]
    for row in (occurrence.WITH_BELT, occurrence.WITH_BELT_PARTS):
        assert not [*row.subjects(several)]
        assert not [*row.subjects(none)]


def test_fixed_trays_bring_rows_of_trays_by_name_and_number() -> None:
    layout = replace(LAYOUT, carriers=(), trays=(Tray(1, "table", Pose()),))
    fixed = replace(load_trial(text="{}"), layout=layout)
    assert occurrence.EACH_FIXED_TRAY.subjects(fixed) == ["table"]
    assert occurrence.EACH_TRAY.subjects(fixed) == ["1"]
    assert [*occurrence.WITH_TRAYS.subjects(fixed)]
    assert not occurrence.EACH_AGV.subjects(fixed)
