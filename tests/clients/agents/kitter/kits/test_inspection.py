"""Inspection of a placed part."""

from types import SimpleNamespace
from typing import cast

import pytest

from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.kits import InspectionResult, KitTask, Task, inspect_part, is_known_faulty, strays
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.perception import Sighting
from cellwright.clients.agents.kitter.pick_and_place import pose_on_tray
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import STATIONS

PLACE = Pose((0.1, 0.1, 0.0))
KINDS = Catalogue()
TASK = Task("gear_part", PLACE, tray_T_part=PLACE)
KIT = KitTask("kit", [TASK], KINDS, station=STATIONS[2])


def beside(dx: float = 0.0, yaw: float = 0.0, part_type: str = "gear_part") -> Sighting:
    """Return a part on tray 2, beside the place of the only part of the kit."""
    shift = Pose.from_rpy((0.1 + dx, 0.1, 0.0), (0.0, 0.0, yaw))
    return Sighting(part_type, pose_on_tray(STATIONS[2], KINDS.figures(part_type), shift))


def view(*seen: Sighting, faulty: tuple[Pose, ...] = (), has_camera: bool = True) -> CellView:
    return cast(
        "CellView",
        SimpleNamespace(
            look=lambda *_: None,
            sees=lambda _pose: has_camera,
            parts_on_tray=lambda _pose: list(seen),
            faulty_on_tray=lambda _number: faulty,
        ),
    )


@pytest.mark.parametrize(
    ("seen", "verdict"),
    [
        ([beside(0.002)], InspectionResult.GOOD),
        ([beside(0.02)], InspectionResult.OUT_OF_PLACE),
        ([beside(yaw=0.1)], InspectionResult.OUT_OF_PLACE),
        ([beside(0.11)], InspectionResult.LOST),
        ([beside(part_type="disk_part")], InspectionResult.LOST),
        ([], InspectionResult.LOST),
    ],
)
def test_inspection_verdict_depends_on_offset_and_type(seen: list[Sighting], verdict: InspectionResult) -> None:
    assert inspect_part(view(*seen), KIT, TASK, PLACE, is_turned=False).verdict is verdict


def test_inspection_reports_offset_and_turn() -> None:
    finding = inspect_part(view(beside(0.02, 0.1), beside(0.3)), KIT, TASK, PLACE, is_turned=False)
    assert finding.offset == pytest.approx(0.02)
    assert finding.turn == pytest.approx(0.1)
    assert finding.world_T_part == beside(0.02, 0.1).world_T_part


def test_inspection_finds_fault_without_camera() -> None:
    fault = beside(0.01).world_T_part
    assert (
        inspect_part(view(faulty=(fault,), has_camera=False), KIT, TASK, PLACE, is_turned=False).verdict
        is InspectionResult.FAULTY
    )
    elsewhere = beside(0.1).world_T_part
    assert (
        inspect_part(view(faulty=(elsewhere,), has_camera=False), KIT, TASK, PLACE, is_turned=False).verdict
        is InspectionResult.UNSEEN
    )


def test_part_away_from_placed_ones_is_stray() -> None:
    stray, other = beside(0.06), beside(-0.3, part_type="disk_part")
    assert strays(view(beside(0.03), stray, other), KIT) == [stray, other]
    assert not is_known_faulty(KIT, stray)
    kit = KitTask("kit", [TASK], KINDS, station=STATIONS[2], faulty=[("gear_part", Pose((0.17, 0.1, 0.0)))])
    assert is_known_faulty(kit, stray)
