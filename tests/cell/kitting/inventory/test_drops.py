import json

import pytest

from cellwright.cell.kitting.inventory import DropZones
from cellwright.config.trial.trial import DropRegion
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

GEAR_1 = DropRegion("over_agv1", "gear_part", (0.0, 2.0, 0.5), (0.5, 3.0, 1.5), Pose((0.1, 3.15, 0.8)))
GEAR_2 = DropRegion("over_agv2", "gear_part", (0.0, -3.0, 0.5), (0.5, -2.0, 1.5), Pose((0.1, -3.15, 0.8)))
GEAR_3 = DropRegion("within_1", "gear_part", (0.1, 2.1, 0.6), (0.2, 2.9, 1.0), Pose((0.2, 3.15, 0.8)))
DISK = DropRegion("disk", "disk_part", (-1.0, -1.0, 0.0), (1.0, 1.0, 2.0), Pose((0.0, 0.0, 0.8)))
REGIONS = (GEAR_1, GEAR_2, GEAR_3, DISK)


@pytest.mark.parametrize(
    ("type_", "position", "region"),
    [
        ("gear_part", (0.2, 2.5, 1.0), GEAR_1),
        ("gear_part", (0.2, -2.5, 1.0), GEAR_2),
        ("gear_part", (0.0, 2.0, 0.5), GEAR_1),
        ("gear_part", (0.5, 3.0, 1.5), GEAR_1),
        ("gear_part", (0.500001, 3.0, 1.5), None),
        ("gear_part", (0.2, 1.999999, 1.0), None),
        ("gear_part", (0.2, 2.5, 1.500001), None),
        ("gear_part", (0.0, 0.0, 1.0), None),
        ("disk_part", (0.0, 0.0, 1.0), DISK),
        ("pulley_part", (0.0, 0.0, 1.0), None),
    ],
)
def test_drop_region_is_closed_box_for_its_type(type_: str, position: Vector3, region: DropRegion | None) -> None:
    assert DropZones(REGIONS).drop(type_, position) == region


def test_type_is_dropped_once_over_all_regions() -> None:
    zones = DropZones(REGIONS)
    assert zones.drop("gear_part", (9.0, 9.0, 9.0)) is None
    assert zones.drop("gear_part", (0.2, 2.5, 1.0)) == GEAR_1
    assert zones.drop("gear_part", (0.2, 2.5, 1.0)) is None
    assert zones.drop("gear_part", (0.2, -2.5, 1.0)) is None
    assert zones.drop("disk_part", (0.2, 0.5, 1.0)) == DISK
    zones.reset()
    assert zones.drop("gear_part", (0.2, -2.5, 1.0)) == GEAR_2


def test_drop_zones_state_survives_json() -> None:
    zones, other = DropZones(REGIONS), DropZones(REGIONS)
    zones.drop("gear_part", (0.2, 2.5, 1.0))
    other.drop("disk_part", (0.0, 0.0, 1.0))
    other.set_state(json.loads(json.dumps(zones.get_state())))
    assert other.get_state() == zones.get_state()
    assert other.drop("gear_part", (0.2, 2.5, 1.0)) is None
    assert other.drop("disk_part", (0.2, 0.5, 1.0)) == DISK


def test_state_of_other_trial_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="pulley_part"):
        DropZones(REGIONS).set_state({"spent": ["pulley_part"]})
