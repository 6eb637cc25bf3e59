"""Cell of 2017 that stands elsewhere, or turned: what knows joint positions alone works it alike.

A cell that still held a place, or an axis of the world, outside its layout would run another way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.cell.devices.kit_tray import TrayPart
from cellwright.cell.entities import Entities
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.named_poses import Box
from cellwright.clients.agents.lesson import LessonAgent
from cellwright.config.trial.moving import moved
from cellwright.config.trial.trial import DropRegion
from cellwright.middleware.messages.conversions import pose_from_message, pose_from_transform, pose_message
from cellwright.middleware.messages.osrf_gear import LogicalCameraImage
from cellwright.running.run import Outcome, RunOptions, RunResult, run_cell
from cellwright.util.pose import Pose
from tests.support.cells import run
from tests.support.culling_effect import leaves
from tests.support.scenario import TRIAL, play

HERE = Pose()
QUARTER = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2))
OBLIQUE = Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 6))

REGION = DropRegion("above", "piston_rod_part", (-0.5, -0.2, 0.85), (-0.1, 0.3, 2.0), Pose((-1.0, 0.995, 0.9)))
"""The cup lifts the rod of bin 7 into it; the rod falls into bin 4."""

NEAR_END = Pose((1.21, -3.0, 0.95))
"""Over the belt, 1 m before the wall at its end."""

PERIOD = Fraction(1, 10)
"""Time between two looks [s]."""


@dataclass
class Run:
    """One run of the lesson, as seen ten times a second."""

    result: RunResult
    closed: list[int] = field(default_factory=list)
    passengers: list[int] = field(default_factory=list)
    reports: list[tuple[TrayPart, ...]] = field(default_factory=list)


@cache
def lesson(by: Pose) -> Run:
    """Return the run of the lesson in a cell that is moved."""
    cell = Cell(moved(load_trial("lesson"), by))
    culling = cell.culling
    assert culling is not None
    closed: list[int] = []
    passengers: list[int] = []
    reports: list[tuple[TrayPart, ...]] = []

    def look(_number: int) -> None:
        closed.append(len(culling.closed))
        passengers.append(len(culling.passengers))

    for tray in cell.trays.values():
        tray.on_report.append(lambda each: reports.append(each.contents))
    cell.simulation.watch("moved", PERIOD, look)
    result = run_cell(cell, LessonAgent(), RunOptions(until=600.0))
    return Run(result, closed, passengers, reports)


def assert_near(one: Pose, other: Pose, *, within: float) -> None:
    """Check that two poses are the same within a distance [m, and rad]."""
    apart = one.relative(other)
    assert math.dist(apart.position, (0.0, 0.0, 0.0)) < within
    assert 2 * math.hypot(*apart.quaternion[1:]) < within


def counts(one: list[int], other: list[int]) -> float:
    """Return the share of looks with other counts."""
    return sum(a != b for a, b in zip(one, other, strict=True)) / len(one)


@pytest.mark.slow
@pytest.mark.parametrize("by", [QUARTER, OBLIQUE], ids=["90", "30"])
def test_moved_cell_gives_same_points_at_same_tick(by: Pose) -> None:
    one, other = lesson(HERE).result, lesson(by).result
    assert (one.outcome, one.steps) == (other.outcome, other.steps)
    assert one.outcome is Outcome.DONE
    assert one.score is not None
    assert other.score is not None
    assert one.score.total == other.score.total == 2.0
    assert one.score.part_travel_time == other.score.part_travel_time


@pytest.mark.slow
def test_cell_turned_by_right_angle_closes_as_much_to_the_engine() -> None:
    # a part that lands a micrometre elsewhere may come to rest a look later
    assert counts(lesson(HERE).closed, lesson(QUARTER).closed) < 0.01
    assert counts(lesson(HERE).passengers, lesson(QUARTER).passengers) < 0.01
    assert max(lesson(QUARTER).passengers) >= 5


@pytest.mark.slow
@pytest.mark.parametrize("by", [QUARTER, OBLIQUE], ids=["90", "30"])
def test_trays_report_same_parts_in_moved_cell(by: Pose) -> None:
    one, other = lesson(HERE).reports, lesson(by).reports
    assert [[each.name for each in report] for report in one] == [[each.name for each in report] for report in other]
    assert any(len(report) >= 2 for report in one)
    for before, after in zip(one, other, strict=True):
        for here, there in zip(before, after, strict=True):
            assert_near(here.pose, there.pose, within=1e-3)


@dataclass
class Heard:
    """Messages and removals of a cell in a scenario with every event, and where its first tray was."""

    cell: Cell
    messages: dict[str, list[Any]]
    trays: list[Pose]
    removed: list[tuple[int, str, Removal]]


@cache
def scenario(by: Pose) -> Heard:
    """Return the scenario in a cell that is moved: every event of four seconds, then eight with a running belt."""
    trial = moved(replace(TRIAL, options=replace(TRIAL.options, fill_demo_tray=True), drop_regions=(REGION,)), by)
    cell = Cell(trial, competition=False)
    found = Heard(cell, {name: [] for name in cell.topics()}, [], [])
    for name in found.messages:
        cell.bus.subscribe(name, found.messages[name].append, node="/listener")
    cell.parts.on_removed.append(lambda part, why: found.removed.append((cell.simulation.now, part.name, why)))
    cell.conveyors["belt"].set_power(100.0)
    play(cell)
    # on its way to the wall at the belt's end
    cell.parts.place(cell.parts.part("bin8|gear_part_1"), by @ NEAR_END)
    cell.simulation.watch("moved", PERIOD, lambda _: found.trays.append(cell.trays[1].world_T_tray))
    run(cell, 8.0)
    return found


def values(message: Any, by: Pose = HERE) -> list[Any]:
    """Return the numbers and texts of a message; a logical camera's own pose is moved."""
    if isinstance(message, LogicalCameraImage):
        message = replace(message, pose=pose_message(by @ pose_from_message(message.pose)))
    return [float(each) if isinstance(each, int | float | np.number) else each for each in leaves(message)]


def is_alike(one: Any, other: Any) -> bool:
    """Return whether two messages have the same content, numbers within a hundredth [m, rad]."""
    return bool(values(one, QUARTER) == pytest.approx(values(other), abs=1e-2, nan_ok=True))


# A logical camera looks for boxes along the axes of the world, which grow in a cell that is turned by 30 degrees.
@pytest.mark.slow
def test_all_topics_say_same_in_cell_turned_by_right_angle() -> None:
    one, other = scenario(HERE).messages, scenario(QUARTER).messages
    assert {name: len(each) for name, each in one.items()} == {name: len(each) for name, each in other.items()}
    for name in one.keys() - {"/tf", "/tf_static"}:
        differing = [pair for pair in zip(one[name], other[name], strict=True) if not is_alike(*pair)]
        # a ray may miss an edge that it met
        assert len(differing) <= 0.01 * len(one[name]), (name, differing[0])


@pytest.mark.slow
def test_frames_of_world_turn_and_others_stay() -> None:
    for name in ("/tf", "/tf_static"):
        for one, other in zip(scenario(HERE).messages[name], scenario(QUARTER).messages[name], strict=True):
            for here, there in zip(one.transforms, other.transforms, strict=True):
                frames = here.header.frame_id, here.child_frame_id
                assert frames == (there.header.frame_id, there.child_frame_id)
                here_T, there_T = pose_from_transform(here.transform), pose_from_transform(there.transform)
                assert_near(QUARTER @ here_T if frames[0] == "world" else here_T, there_T, within=2e-2)


@pytest.mark.slow
@pytest.mark.parametrize("by", [QUARTER, OBLIQUE], ids=["90", "30"])
def test_agv_drives_same_way_in_moved_cell(by: Pose) -> None:
    one, other = scenario(HERE).trays, scenario(by).trays
    assert max(math.dist(one[0].position, each.position) for each in one) > 4.0
    for here, there in zip(one, other, strict=True):
        assert_near(by @ here, there, within=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("by", [QUARTER, OBLIQUE], ids=["90", "30"])
def test_same_parts_leave_moved_cell_at_same_time(by: Pose) -> None:
    assert {why for _, _, why in scenario(HERE).removed} == {Removal.DELETION_WALL, Removal.DELIVERY}
    assert scenario(by).removed == scenario(HERE).removed


@pytest.mark.slow
@pytest.mark.parametrize("by", [QUARTER, OBLIQUE], ids=["90", "30"])
def test_parts_end_at_same_places_of_moved_cell(by: Pose) -> None:
    one, other = scenario(HERE).cell, scenario(by).cell
    assert one.parts.in_play == other.parts.in_play
    for name in one.parts.in_play:
        here, there = one.parts.pose(one.parts.part(name)), other.parts.pose(other.parts.part(name))
        assert_near(by @ here, there, within=2e-2)
    dropped = one.parts.pose(one.parts.part("bin7|piston_rod_part_5"))
    assert math.dist(dropped.position[:2], REGION.destination.position[:2]) < 0.01


@pytest.mark.slow
def test_entities_and_named_poses_of_cell_turned_by_right_angle_are_turned() -> None:
    one, other = Entities(scenario(HERE).cell), Entities(scenario(QUARTER).cell)
    assert one.names() == other.names()
    for name in one.names():
        assert_near(QUARTER @ one.state(name).pose, other.state(name).pose, within=2e-2)
        here, there = one.bounds(name), other.bounds(name)
        assert (here is None) == (there is None)
        if here is not None and there is not None:
            assert_turned(here, there)
    for before, after in zip(one.named_poses(), other.named_poses(), strict=True):
        assert before.name == after.name
        assert_near(QUARTER @ before.pose, after.pose, within=1e-9)
        assert_turned(before.space, after.space)


def assert_turned(here: Box, there: Box) -> None:
    """Check that a box is another one, turned by a right angle."""
    corners = [QUARTER.transform(each) for each in (here.lower, here.upper)]
    lower, upper = np.min(corners, axis=0), np.max(corners, axis=0)
    assert there.lower == pytest.approx(lower, abs=2e-2)
    assert there.upper == pytest.approx(upper, abs=2e-2)
