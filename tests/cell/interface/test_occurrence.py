import pytest

from cellwright import load_trial
from cellwright.cell.interface import occurrence
from cellwright.config.trial.trial import Trial

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
    ("text", "agvs", "cameras"), [("{}", ("1", "2"), True), ("options: {insert_agvs: false}", (), False)]
)
def test_agvs_bring_their_rows_and_quality_sensors(text: str, agvs: tuple[str, ...], cameras: bool) -> None:
    assert tuple(occurrence.EACH_AGV.subjects(trial(text))) == agvs
    assert bool([*occurrence.WITH_AGVS.subjects(trial(text))]) is bool(agvs)
    assert bool([*occurrence.WITH_CAMERAS.subjects(trial(text))]) is cameras


def test_arm_and_belt_parts_bring_their_rows() -> None:
    lesson = load_trial("lesson")
    assert [*occurrence.WITH_ARM.subjects(lesson)]
    assert not [*occurrence.WITH_ARM.subjects(trial("{}"))]
    assert not [*occurrence.WITH_BELT_PARTS.subjects(trial("{}"))]
