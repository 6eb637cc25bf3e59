"""Entities of a cell: what there is, where it is, and how a program arranges it."""

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.entities import MAX_SPEED, Category, Entities, EntityInfo
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from tests.cell.robot_cells import tandem_cell

TRAY = "agv1::kit_tray_1::kit_tray_1::tray"
GEAR, DISK = "bin7|gear_part_1", "bin6|disk_part_1"
TRIAL = Trial(
    "arranged",
    has_arm=True,
    bin_parts=(Part(GEAR, "gear_part", Pose((-0.3, 0.2, 0.75))), Part(DISK, "disk_part", Pose((-0.3, -0.6, 0.75)))),
)
HIGH = Pose((-0.3, 0.2, 1.5))


@pytest.fixture
def entities() -> Entities:
    return Entities(Cell(TRIAL, competition=False))


def test_names_are_furniture_and_parts_in_play(entities: Entities) -> None:
    names = entities.names()
    assert names[-2:] == [GEAR, DISK]
    assert {"arm", "agv1", TRAY, "bin1", "conveyor_belt"} < set(names)
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("name", "category", "tags"),
    [
        (GEAR, Category.OBJECT, ("gear_part",)),
        ("arm", Category.ROBOT, ()),
        ("agv2", Category.ROBOT, ()),
        (TRAY, Category.DYNAMIC_OBJECT, ("tray",)),
        ("bin3", Category.STATIC_OBJECT, ("bin",)),
        ("conveyor_belt", Category.STATIC_OBJECT, ()),
    ],
)
def test_info_has_category_and_tags(entities: Entities, name: str, category: Category, tags: tuple[str, ...]) -> None:
    info = entities.info(name)
    assert (info.category, info.tags) == (category, tags)


def test_unknown_entity_is_refused_with_a_similar_name(entities: Entities) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean bin7\|gear_part_1"):
        entities.state("bin7|gear_prat_1")


def test_placed_part_is_there_and_at_rest(entities: Entities) -> None:
    entities.set_state(GEAR, HIGH, None)
    state = entities.state(GEAR)
    assert (state.pose, state.linear, state.angular) == (HIGH, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_velocity_without_a_pose_leaves_the_part_where_it_is(entities: Entities) -> None:
    before = entities.state(GEAR).pose
    entities.set_state(GEAR, None, ((0.0, 0.0, 1.0), (0.0, 0.0, 0.5)))
    state = entities.state(GEAR)
    assert (state.pose, state.linear) == (before, (0.0, 0.0, 1.0))
    assert state.angular == pytest.approx((0.0, 0.0, 0.5))


def test_falling_part_accelerates_downward(entities: Entities) -> None:
    entities.set_state(GEAR, HIGH, None)
    for _ in range(5):
        entities.cell.step()
    assert entities.state(GEAR).linear_acceleration == pytest.approx((0.0, 0.0, -9.8), abs=0.2)


@pytest.mark.parametrize(
    ("name", "pose", "speed"),
    [("bin1", HIGH, 0.0), (GEAR, Pose((0.0, 0.0, 1e3)), 0.0), (GEAR, HIGH, 2 * MAX_SPEED), (GEAR, HIGH, float("nan"))],
)
def test_refused_state_changes_nothing(entities: Entities, name: str, pose: Pose, speed: float) -> None:
    before = entities.cell.state_hash()
    with pytest.raises(RejectedCommandError):
        entities.set_state(name, pose, ((speed, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert entities.cell.state_hash() == before


def test_deleted_part_waits_and_can_be_spawned(entities: Entities) -> None:
    assert entities.spawnable() == {}
    entities.delete(GEAR)
    assert GEAR not in entities.names()
    assert entities.spawnable() == {"gear_part": 1}
    assert entities.spawn("gear_part", "", HIGH) == GEAR
    assert entities.spawned == {GEAR: ("gear_part", HIGH)}
    assert entities.state(GEAR).pose == HIGH


def test_what_is_known_is_forgotten_with_the_run_and_restored_with_a_snapshot(entities: Entities) -> None:
    entities.set_info(DISK, EntityInfo(Category.HUMAN, "mine"))
    snapshot = entities.cell.snapshot()
    entities.cell.reset()
    assert entities.info(DISK).description == "part of type disk_part"
    entities.cell.restore(snapshot)
    assert entities.info(DISK).description == "mine"


def test_bounds_contain_the_part(entities: Entities) -> None:
    entities.set_state(GEAR, HIGH, None)
    box = entities.bounds(GEAR)
    assert box is not None
    assert all(low < at < high for low, at, high in zip(box.lower[:2], HIGH.position, box.upper, strict=False))
    assert box.lower[2] == pytest.approx(1.5, abs=1e-3)


def test_frames_are_the_world_links_entities_and_fixed_frames(entities: Entities) -> None:
    assert entities.frame("world") == Pose((0.0, 0.0, 0.0))
    assert entities.frame(GEAR) == entities.state(GEAR).pose
    assert entities.frame("forearm_link").position[2] > 1.0
    assert entities.frame("agv1_load_point_frame").position[1] > 3.0
    with pytest.raises(UnknownNameError):
        entities.frame("nowhere")


def test_robot_is_an_entity_with_links_by_their_frames() -> None:
    cell = Cell(tandem_cell())
    entities = Entities(cell)
    assert entities.info("tandem") == EntityInfo(Category.ROBOT, "robot tandem, on topics of /left")
    box = entities.bounds("tandem")
    assert box is not None
    assert box.upper[2] - box.lower[2] > 1.0
    cell.simulation.refresh()
    place = tuple(cell.simulation.data.body("tandem/right_hand").xpos.tolist())
    assert entities.frame("tandem_right_hand").position == place
