"""Clones of the belt in the running cell: the bodies that they take in turn, and runs that need more of these."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.logical_camera import LogicalCamera
from cellwright.cell.kitting.fates import Removal
from cellwright.cell.model import build
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import BeltPart, Options, Part, Trial
from cellwright.engine.snapshot import read_checkpoint, restore_snapshot, take_snapshot, write_checkpoint
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.util.pose import Pose
from tests.cell.devices.floor import OVER_BINS
from tests.support.places import BELT_SURFACE, BIN_SURFACE, TRAY_SURFACE

CAMERA = SensorConfig("eye", "logical_camera", Pose.from_rpy((1.21, 0.0, 1.5), (0.0, np.pi / 2, 0.0)))
HOARDED = Trial(
    "hoarded",
    sensors=(CAMERA,),
    options=Options(belt_population_cycles=6),
    bin_parts=(
        Part("bin7|part2_1", "part2", Pose((-0.3, 0.2, BIN_SURFACE + 0.05))),
        Part("bin7|disk_part_1", "disk_part", Pose((-0.3, 0.4, BIN_SURFACE + 0.002))),
    ),
    belt_parts=(BeltPart(60.0, "gear_part", Pose()), BeltPart(70.0, "disk_part", Pose())),
)
GROW = 50
"""Ticks between two clones that appear in `hoard`."""


def gear(number: int) -> str:
    return f"populate_conveyor|gear_part_clone_{number}"


def hoard(cell: Cell, number: int) -> None:
    """Let a clone fall onto the belt, and go on for a while; the second and the third take the last free body."""
    cell.parts.appear(gear(number), Pose((1.21, 4.0 - 0.5 * number, BELT_SURFACE + 0.05)))
    for _ in range(GROW):
        cell.step()


def moving(*, has_arm: bool = False) -> Cell:
    """Return a cell with the belt running, its arm swinging, and a part that an AGV drives away with."""
    cell = Cell(replace(HOARDED, has_arm=has_arm), competition=False)
    if cell.arm is not None:
        cell.arm.command(JointTrajectory(ARM_JOINTS, [TrajectoryPoint(list(OVER_BINS), time_from_start_ns=3 * 10**9)]))
    cell.conveyors["belt"].set_power(100.0)
    for _ in range(200):  # until all bodies that wait are asleep
        cell.step()
    cell.parts.place(cell.parts.part("bin7|disk_part_1"), Pose((0.3, 3.2, TRAY_SURFACE + 0.002)))
    for _ in range(310):
        cell.step()
    cell.agvs[1].handle_depart()
    return cell


def bodies(cell: Cell) -> list[int]:
    return [part.body for part in cell.parts.all if part.name.startswith("populate_conveyor|")]


def places(cell: Cell) -> dict[str, Pose]:
    return {part.name: cell.parts.pose(part) for part in cell.parts.all}


@pytest.fixture(scope="module")
def shared() -> Cell:
    return Cell(HOARDED, competition=False)


@pytest.fixture
def cell(shared: Cell) -> Cell:
    shared.reset()
    return shared


def test_clone_takes_first_free_body_of_its_type(cell: Cell) -> None:
    gears = [body.body for body in cell.world.bodies if body.type == "gear_part"]
    disks = [body.body for body in cell.world.bodies if body.type == "disk_part"]
    assert (len(gears), len(disks)) == (2, 2)
    for number in range(2):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    cell.parts.appear("populate_conveyor|disk_part_clone_4", Pose((0.0, 0.0, 4.0)))
    assert bodies(cell) == [*gears, disks[0]]


def test_body_of_clone_that_left_is_taken_again(cell: Cell) -> None:
    for number in range(2):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    first = cell.parts.part(gear(0))
    cell.parts.put_away(first, Removal.DELETION_WALL)
    assert gear(0) not in cell.parts.by_name
    assert cell.parts.by_body.get(first.body) is None
    cell.parts.appear(gear(5), Pose((0.0, 0.0, 2.0)))
    assert cell.parts.part(gear(5)).body == first.body
    assert cell.parts.by_body[first.body].name == gear(5)


def test_parts_with_bodies_are_in_the_order_of_all_parts(cell: Cell) -> None:
    for number in (4, 1, 3):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    names = ["bin7|part2_1", "bin7|disk_part_1", gear(1), gear(3), gear(4)]
    assert [part.name for part in cell.parts.all] == names
    assert [part.name for part in cell.parts.inside((-9, -9, 0), (9, 9, 9))] == names
    assert [name for name, _, is_shown in cell.scene_parts() if is_shown] == names
    assert [name for name in cell.parts.names if name in names] == names


def test_model_grows_before_the_step_after_the_last_free_body_was_taken(cell: Cell) -> None:
    model = cell.simulation.model
    for number in range(2):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    assert cell.simulation.model is model
    cell.step()
    assert [body.type for body in cell.parts.world.bodies] == ["gear_part"] * 2 + ["disk_part"] * 2 + ["gear_part"] * 2
    assert cell.simulation.model.nbody > model.nbody
    cell.step()
    assert cell.simulation.model is cell.parts.world.model
    assert cell.simulation.time == 0.004


def test_clone_that_finds_no_free_body_grows_the_model_at_once(cell: Cell) -> None:
    for number in range(3):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    assert len(set(bodies(cell))) == 3


def test_model_has_no_more_bodies_than_clones(cell: Cell) -> None:
    for number in range(6):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
        cell.step()
    assert [body.type for body in cell.parts.world.bodies].count("gear_part") == 6


@pytest.mark.parametrize("has_arm", [False, True])
def test_run_that_grows_is_the_run_with_all_bodies_from_the_begin(
    monkeypatch: pytest.MonkeyPatch, *, has_arm: bool
) -> None:
    growing = moving(has_arm=has_arm)
    monkeypatch.setattr(build, "first_bodies", lambda trial: [kind for _, kind in trial.belt_clones()])
    full = moving(has_arm=has_arm)
    before = growing.simulation.model.nbody
    for number in range(6):
        for cell in (growing, full):
            hoard(cell, number)
        assert places(growing) == places(full)
        if growing.arm is not None and full.arm is not None:
            assert growing.arm.read() == full.arm.read()
    assert before < growing.simulation.model.nbody < full.simulation.model.nbody
    assert growing.parts.is_locked(growing.parts.part("bin7|disk_part_1"))


def test_reset_after_growth_begins_the_same_run(cell: Cell) -> None:
    begin, model = cell.state_hash(), cell.simulation.model
    for number in range(4):
        hoard(cell, number)
    end = cell.state_hash()
    cell.reset()
    assert cell.simulation.model is model
    assert cell.state_hash() == begin
    for number in range(4):
        hoard(cell, number)
    assert cell.state_hash() == end


def finish(cell: Cell, first: int) -> str:
    for number in range(first, 6):
        hoard(cell, number)
    return cell.state_hash()


@pytest.mark.parametrize("moment", [1, 4])
def test_snapshot_continues_in_cell_with_fewer_or_more_bodies(moment: int) -> None:
    cell = moving()
    for number in range(moment):
        hoard(cell, number)
    snapshot = take_snapshot(cell.simulation)
    end = finish(cell, moment)
    restore_snapshot(cell.simulation, snapshot)  # it has more bodies by now
    assert finish(cell, moment) == end
    other = moving()
    restore_snapshot(other.simulation, snapshot)
    assert finish(other, moment) == end


@pytest.mark.parametrize("moment", [1, 4])
def test_checkpoint_continues_in_cell_with_fewer_or_more_bodies(tmp_path: Path, moment: int) -> None:
    cell = moving()
    for number in range(moment):
        hoard(cell, number)
    write_checkpoint(cell.simulation, tmp_path / "c.npz")
    end = finish(cell, moment)
    read_checkpoint(cell.simulation, tmp_path / "c.npz")
    assert finish(cell, moment) == end
    other = Cell(HOARDED, competition=False)
    read_checkpoint(other.simulation, tmp_path / "c.npz")
    assert finish(other, moment) == end


OTHER_PROCESS = "from tests.cell.devices.test_clones import *; print(finish(moving(), 0))"


@pytest.mark.slow
def test_run_that_grows_is_the_same_in_another_process() -> None:
    folder = Path(__file__).parents[3]
    other = subprocess.run(
        [sys.executable, "-c", OTHER_PROCESS], capture_output=True, text=True, check=True, cwd=folder
    )
    assert other.stdout.strip() == finish(moving(), 0)


def test_camera_sees_clones_by_their_names(cell: Cell) -> None:
    camera = cell.sensors["eye"]
    assert isinstance(camera, LogicalCamera)
    assert camera.read().detections == ()
    under = Pose((1.21, 0.0, BELT_SURFACE + 0.01))
    cell.parts.appear(gear(2), under)
    before = camera.read()
    cell.parts.put_away(cell.parts.part(gear(2)))
    cell.parts.appear(gear(3), under)
    assert [each.name for each in camera.read().detections] == [gear(3)]
    for number in (4, 5):
        cell.parts.appear(gear(number), Pose((0.0, 0.0, 2.0 + number)))
    cell.step()
    assert [each.name for each in before.detections] == [gear(2)]  # looked up only now, in a larger model
    cell.reset()
    assert camera.read().detections == ()


def changed(cell: Cell, act: Callable[[], None]) -> str:
    cell.reset()
    act()
    for _ in range(20):
        cell.step()
    return cell.state_hash()


def test_watching_a_run_that_grows_changes_nothing(cell: Cell) -> None:
    def work() -> None:
        for number in range(4):
            hoard(cell, number)

    alone = changed(cell, work)
    leave = cell.sensors["eye"].listen(lambda reading: reading.detections)
    watched = changed(cell, work)
    leave()
    assert watched == alone
