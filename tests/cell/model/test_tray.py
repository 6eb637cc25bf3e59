"""Trays as solid bodies: plates, rims, and the stand of a fixed one."""

from dataclasses import replace

import pytest

from cellwright.cell.model.build import build_world
from cellwright.cell.model.tray import plate_name
from cellwright.config.layout.layout import Tray
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose
from tests.cell.model.bench import MM, Bench
from tests.support.places import LAYOUT

TABLE = Tray(3, "table", Pose.from_rpy((-2.5, 0.0, 0.0), (0.0, 0.0, 0.3)), size=(0.4, 0.6), surface=0.6)


def with_tray(tray: Tray, *parts: Part) -> Trial:
    return Trial("tray", extra_parts=parts, layout=replace(LAYOUT, trays=(tray,)))


def test_plate_of_fixed_tray_has_size_and_height_of_layout() -> None:
    bench = Bench(with_tray(TABLE))
    plate = bench.model.geom(plate_name(TABLE))
    assert plate_name(TABLE) == "kit_tray_3_plate"
    assert plate.size[:2] == pytest.approx((0.2, 0.3))
    assert bench.model.body(TABLE.tray_link).pos[2] + plate.pos[2] + plate.size[2] == pytest.approx(0.6)
    assert bench.model.body_treeid[plate.bodyid[0]] == -1


@pytest.mark.parametrize(("rim", "capsules"), [(0.0204, 12), (0.0068, 4), (0.0, 0)])
def test_rim_is_a_stack_of_capsules_as_high_as_it(rim: float, capsules: int) -> None:
    bench = Bench(with_tray(replace(TABLE, rim=rim)))
    body = bench.model.body(TABLE.tray_link)
    geoms = range(int(body.geomadr[0]), int(body.geomadr[0] + body.geomnum[0]))
    found = [geom for geom in geoms if bench.model.geom_type[geom] == 3]
    assert len(found) == capsules
    tops = [bench.model.geom_pos[geom][2] + bench.model.geom_size[geom][0] for geom in found]
    assert max(tops, default=0.005) == pytest.approx(0.005 + rim)


def test_part_comes_to_rest_on_fixed_tray() -> None:
    gear = Part("table|gear_part_1", "gear_part", Pose((0.1, -0.2, 0.05)), frame=TABLE.tray_link)
    bench = Bench(with_tray(TABLE, gear))
    bench.run(1.5)
    at = (TABLE.tray_frame @ gear.pose).position
    assert bench.position(bench.part(gear.name)) == pytest.approx((at[0], at[1], 0.6), abs=MM)
    assert bench.asleep(bench.part(gear.name))


def test_tray_on_the_floor_has_no_stand() -> None:
    high, low = (build_world(with_tray(replace(TABLE, surface=z))).model for z in (0.6, 0.05))
    assert high.body(TABLE.tray_link).geomnum[0] == low.body(TABLE.tray_link).geomnum[0] + 1
