"""Choice of the part to take."""

from types import SimpleNamespace
from typing import cast

from cellwright.clients.agents.kitter.agreement import Agreement
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.perception import Sighting, TrackedBeltPart
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.supply import ATTEMPTS, BELT_HORIZON, Supply, bin_cell
from cellwright.clients.client import Client
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM, BELT, BELT_SPEED, WORKPLACE


def lying(x: float, y: float, part_type: str = "gear_part") -> Sighting:
    return Sighting(part_type, Pose((x, y, 0.725)))


def supply(*coming: TrackedBeltPart, reachable: float | None = -0.5) -> Supply:
    """Return a supply at time 0, the rail at y = 0; belt parts can be met at one place, or nowhere."""
    belt = SimpleNamespace(coming=lambda *_: list(coming))
    view = SimpleNamespace(belts=[belt], workplace=WORKPLACE, not_upright={"disk_part"})
    return Supply(
        cast("Client", SimpleNamespace(time=0.0)),
        cast("CellView", view),
        cast("KitterArm", SimpleNamespace(joints=(0.0,) * 7, postures=ARM)),
        cast("Manipulator", SimpleNamespace(meeting_place=lambda *_: reachable)),
        Agreement().share(),
    )


def test_best_part_is_nearest_of_type() -> None:
    near = lying(-0.4, 0.1)
    parts = [lying(-0.4, 0.9), near, lying(-0.1, 0.0, "disk_part"), lying(-0.5, 0.1)]
    assert supply().best("gear_part", parts) is near
    assert supply().best("pulley_part", parts) is None


def test_best_part_has_ordered_side_up() -> None:
    near, far = lying(-0.4, 0.1, "pulley_part"), Sighting("pulley_part", Pose((-0.4, 0.9, 0.725)), is_turned=True)
    assert supply().best("pulley_part", [near, far]) is near
    assert supply().best("pulley_part", [near, far], is_turned=True) is far
    assert supply().best("pulley_part", [near], is_turned=True) is near


def test_failed_part_is_tried_last_and_then_given_up() -> None:
    found = supply()
    near, far = lying(-0.4, 0.1), lying(-0.4, 0.9)
    found.note_failure("gear_part", near.world_T_part)
    assert found.best("gear_part", [near, far]) is far
    assert found.best("gear_part", [near]) is near
    for _ in range(ATTEMPTS - 1):
        found.note_failure("gear_part", near.world_T_part)
    assert found.failures(near.world_T_part) == ATTEMPTS
    assert found.best("gear_part", [near]) is None


def test_missing_part_has_reason() -> None:
    found = supply()
    place = lying(-0.4, 0.1).world_T_part
    found.note_failure("gear_part", place, is_in_reach=False)
    assert found.why_none("gear_part") == "all visible ones are out of the arm's reach"
    found.note_failure("gear_part", place)
    assert found.why_none("gear_part") == "the cup gripped none in 1 attempt"
    assert found.why_none("disk_part") == "all visible ones lie with the wrong side up, or on something else"
    assert found.why_none("pulley_part") == "none was seen"


def test_bin_cell_is_same_for_small_offset() -> None:
    assert bin_cell(Pose((0.1, 0.2, 0.7))) == bin_cell(Pose((0.11, 0.19, 0.8)))
    assert bin_cell(Pose((0.1, 0.2, 0.7))) != bin_cell(Pose((0.16, 0.2, 0.7)))


def test_belt_part_is_chosen_only_if_it_comes_soon() -> None:
    soon = TrackedBeltPart("gear_part", BELT, [Pose((1.21, 1.0, 0.907))])
    late = TrackedBeltPart("gear_part", BELT, [Pose((1.21, 0.5 + BELT_SPEED * (BELT_HORIZON + 1.0), 0.907))])
    meeting = supply(soon, late).on_belt("gear_part")
    assert meeting == (soon, -0.5)
    assert supply(late).on_belt("gear_part") is None
    assert supply(soon, reachable=None).on_belt("gear_part") is None
