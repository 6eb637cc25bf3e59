"""Cells with any number of everything: each runs equally twice, and is restored equally, with every topic heard."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from cellwright import Cell, load_trial
from cellwright.config.layout.layout import Belt, Carrier, Layout, Tray
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.trial import BeltPart, Kit, KitObject, Options, Order, Part, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.middleware.messages.osrf_gear import (
    AGVControlRequest,
    ConveyorBeltControlRequest,
    ConveyorBeltState,
    GetMaterialLocationsRequest,
    PopulationControlRequest,
    SubmitTrayRequest,
)
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose
from cellwright.viewer.services.cell_panel import CellPanel
from tests.support.places import BELT, BELT_SURFACE, LAYOUT

WHOLE = load_trial(find_trial("final01"), find_trial("kitter_sensors"))
ALONE = replace(WHOLE, bin_parts=(), extra_parts=())
"""The same without parts in bins and on trays."""

RIDERS = tuple(BeltPart(1.0 + k, "gear_part", Pose((0.0, 0.0, 0.1))) for k in range(8))
"""One gear a second, which rides in the middle of the belt."""

MIDDLE, END = 8.0, 13.0
"""Times of the snapshot and of the end [s]: AGVs turn back after 11 s, in between."""

TRAY = Tray(1, "table", Pose.from_rpy((0.45, 0.3, 0.0), (0.0, 0.0, 0.4)))
OTHER = replace(TRAY, number=2, name="other", pose=Pose((-2.5, 0.0, 0.0)))
GEAR = Part("table|gear_part_1", "gear_part", Pose((0.1, 0.1, 0.01)), frame=TRAY.tray_link)
KIT = Kit("order_0_kit_0", (KitObject("gear_part", Pose((0.1, 0.1, 0.0))),), tray="table")
TWO_KITS = (KIT, replace(KIT, kit_type="order_0_kit_1"))


def belt_at(middle: Pose, direction: tuple[float, float, float], *, name: str = "belt", length: float = 6.0) -> Belt:
    """Return a belt whose parts appear 1 m behind its begin, at the height of that of 2017."""
    x, y, z = middle.position
    begin, end = ((x + along * direction[0], y + along * direction[1]) for along in (1 - length / 2, length / 2))
    return Belt(
        name=name,
        body="conveyor_belt" if name == "belt" else name,
        centre=middle,
        size=(length, *BELT.size[1:]),
        speed=0.2,
        direction=direction,
        spawn=Pose((*begin, z), middle.quaternion),
        frame=Pose((x, y, 0.91)),
        wall=Pose((*end, 1.41), middle.quaternion),
    )


def third_agv() -> Carrier:
    """Return an AGV with a name of its own, behind the bins."""
    home = Pose((-3.0, 0.0, 0.0))
    return replace(
        LAYOUT.carriers[1],
        number=3,
        name="left",
        home=home,
        tray_link="left::kit_tray_3::kit_tray_3::tray",
        tray_frame=Pose((-3.0, 0.15, 0.75)),
        quality=Pose.from_rpy((-3.0, 0.35, 1.5), (0.0, 1.574, 1.574)),
        out=(("0", -3.0, 0.0), ("4", -5.0, 0.0)),
        back=(("0", -5.0, 0.0), ("4", -3.0, 0.0)),
    )


def more_bins() -> Layout:
    first = LAYOUT.bins[0]
    places = [Pose((-1.9, -1.33 + 0.8 * k, 0.0)) for k in range(4)]
    more = (replace(first, name=f"bin{n}", pose=each, link=each) for n, each in enumerate(places, 9))
    return replace(LAYOUT, bins=(*LAYOUT.bins, *more))


def with_belts(*belts: Belt, base: Trial = WHOLE) -> Trial:
    """Return a trial with these belts, on each of which gears come."""
    parts = tuple(replace(part, belt=each.name) for each in belts for part in RIDERS)
    options = replace(base.options, belt_population_cycles=2)
    return replace(base, layout=replace(base.layout, belts=belts), belt_parts=parts, options=options)


OPPOSITE = (
    belt_at(Pose.from_rpy((1.21, 0.0, 0.8126), (0.0, 0.0, -math.pi / 2)), (0.0, -1.0, 0.0)),
    belt_at(Pose.from_rpy((2.4, 0.0, 0.8126), (0.0, 0.0, math.pi / 2)), (0.0, 1.0, 0.0), name="back"),
)
OBLIQUE = belt_at(Pose.from_rpy((4.0, 3.0, 0.8126), (0.0, 0.0, -math.pi / 4)), (math.sqrt(0.5), -math.sqrt(0.5), 0.0))
FIXED = Trial(
    "fixed",
    orders=(Order("order_0", TWO_KITS, start_time=0.0),),
    extra_parts=(GEAR,),
    material_locations={"gear_part": ("bin1",)},
    options=Options(spawn_extra_models=True),
    layout=replace(
        LAYOUT, carriers=(), trays=(TRAY, replace(TRAY, number=2, name="other", pose=Pose((-2.5, 0.0, 0.0))))
    ),
)

CASES: dict[str, Trial] = {
    "no bins": replace(ALONE, layout=replace(LAYOUT, bins=())),
    "twelve bins": replace(WHOLE, layout=more_bins()),
    "no carriers": replace(ALONE, layout=replace(LAYOUT, carriers=())),
    "one carrier": replace(ALONE, layout=replace(LAYOUT, carriers=LAYOUT.carriers[:1])),
    "the other carrier": replace(ALONE, layout=replace(LAYOUT, carriers=LAYOUT.carriers[1:])),
    "three carriers": replace(ALONE, layout=replace(LAYOUT, carriers=(*LAYOUT.carriers, third_agv()))),
    "other belt": with_belts(replace(belt_at(BELT.centre, BELT.direction, length=3.0), speed=0.1)),
    "no belt": replace(WHOLE, layout=replace(LAYOUT, belts=()), belt_parts=()),
    "oblique belt": with_belts(OBLIQUE),
    "belt without wall": with_belts(replace(OPPOSITE[0], wall=None)),
    "two belts": with_belts(*OPPOSITE),
    "fixed trays": FIXED,
    "nothing": Trial("nothing", layout=replace(LAYOUT, bins=(), belts=(), carriers=())),
}


def listened(trial: Trial) -> tuple[Cell, list[str]]:
    """Return a cell whose topics are all subscribed to, and the names of the topics of all messages."""
    cell, heard = Cell(trial, competition=False), list[str]()

    def hear(topic: str) -> Callable[[object], None]:
        return lambda _message: heard.append(topic)

    for topic in cell.topics():
        cell.bus.subscribe(topic, hear(topic))
    return cell, heard


def play(cell: Cell, seconds: float) -> str:
    """Start the competition, send everything off after 2 s, and return the state hash after some seconds."""
    cell.competition.start()
    cell.simulation.step_until(2_000_000_000)
    for sender in cell.senders.values():
        assert sender.send("order_0_kit_0")
    cell.simulation.step_until(round(seconds * 1e9))
    json = CellPanel(cell).panel()
    assert [each["name"] for each in json["belts"]] == [each.name for each in cell.trial.layout.belts]
    assert len(json["trays"]) == len(cell.trial.stations)
    return cell.state_hash()


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_any_layout_runs_equally_twice_and_is_restored_equally(name: str) -> None:
    first, heard = listened(CASES[name])
    second, others = listened(CASES[name])
    whole = play(first, END)
    play(second, MIDDLE)
    middle = second.snapshot()
    second.simulation.step_until(nanoseconds(END))
    assert second.state_hash() == whole
    assert heard == others
    second.restore(middle)
    second.simulation.step_until(nanoseconds(END))
    assert second.state_hash() == whole
    restored = Cell(CASES[name], competition=False)
    restored.restore(middle)
    restored.simulation.step_until(nanoseconds(END))
    assert restored.state_hash() == whole


def test_topics_and_services_follow_names_of_layout() -> None:
    cell = Cell(replace(ALONE, sensors=(), layout=replace(LAYOUT, carriers=(third_agv(),))))
    services = {each.name for each in cell.bus.services()}
    assert {"/ariac/left", "/ariac/kit_tray_3/clear_tray", "/ariac/conveyor/control"} <= services
    assert {"/ariac/left/state", "/ariac/quality_control_sensor_3"} <= set(cell.topics())
    assert not any("agv" in name for name in (*services, *cell.topics()))


def riders(cell: Cell, name: str) -> list[str]:
    """Return the parts that are passengers of a belt."""
    assert cell.culling is not None
    belt = cell.simulation.model.body(cell.trial.layout.belt(name).body).id
    return [cell.parts.by_body[body].name for body, carrier in cell.culling.passengers.items() if carrier == belt]


@pytest.mark.slow
def test_belts_in_opposite_directions_carry_passengers_of_their_own() -> None:
    cell = Cell(with_belts(*OPPOSITE, base=replace(ALONE, has_arm=False, sensors=())), competition=False)
    for conveyor in cell.conveyors.values():
        conveyor.set_power(100.0)
    for population in cell.populations.values():
        population.control("restart")
    cell.simulation.step_until(8_000_000_000)
    down, up = riders(cell, "belt"), riders(cell, "back")
    assert min(len(down), len(up)) >= 3
    assert not {*down} & {*up}
    before = {name: cell.parts.pose(cell.parts.part(name)).position for name in (*down, *up)}
    cell.conveyors["back"].set_power(50.0)
    cell.simulation.step_until(9_000_000_000)
    for names, speed in ((down, -0.2), (up, 0.1)):
        for name in names:
            now = cell.parts.pose(cell.parts.part(name)).position
            assert now[1] - before[name][1] == pytest.approx(speed, abs=2e-3)
            assert now[2] == pytest.approx(before[name][2], abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("culled", [True, False])
@pytest.mark.parametrize("belts", [OPPOSITE, (OBLIQUE,)], ids=["opposite", "oblique"])
def test_belt_carries_its_parts_to_its_wall(belts: tuple[Belt, ...], culled: bool) -> None:
    base = replace(ALONE, has_arm=False, sensors=(), settings=replace(ALONE.settings, collision_culling=culled))
    cell = Cell(with_belts(*(replace(each, speed=0.4) for each in belts), base=base), competition=False)
    cell.competition.start()
    cell.simulation.step_until(17_000_000_000)
    for belt in belts:
        first = cell.trial.first_clones(belt.name).get("gear_part", 0)
        brought = [f"populate_conveyor|gear_part_clone_{first + k}" for k in range(16)]
        assert brought[0] not in cell.parts.in_play  # removed at the wall, 5 m further on
        assert brought[-1] in cell.parts.in_play
        for name in brought[8:]:
            position = cell.parts.pose(cell.parts.part(name)).position
            assert belt.covers(*position[:2])
            assert position[2] == pytest.approx(BELT_SURFACE, abs=2e-3)


def test_oblique_belt_has_no_passenger_beyond_its_end() -> None:
    trial = with_belts(replace(OBLIQUE, wall=None), base=replace(ALONE, has_arm=False, sensors=()))
    cell = Cell(trial, competition=False)
    x, y, _ = OBLIQUE.centre.position
    along, _, _ = OBLIQUE.direction
    name = "populate_conveyor|gear_part_clone_0"
    cell.parts.appear(name, Pose((x + 2.5 * along, y - 2.5 * along, BELT_SURFACE + 0.001)))
    cell.conveyors["belt"].set_power(100.0)
    cell.simulation.step_until(1_500_000_000)
    assert riders(cell, "belt") == [name]
    cell.simulation.step_until(4_000_000_000)
    assert riders(cell, "belt") == []
    assert cell.parts.pose(cell.parts.part(name)).position[2] < BELT_SURFACE - 0.1


DROP = """
cell:
  belts: {belt: {from: [0, 1], to: [0, -1], width: 0.4, surface: 0.5, ends: drop}}
  trays: {table: {at: [2, 0]}}
parts: [{type: disk_part, on: belt, every: 2, count: 3}]
orders: {order_0: {tray: table, parts: [{type: disk_part}]}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("culled", ["true", "false"])
def test_parts_drop_off_the_end_of_a_belt_and_are_said_to_lie_on_the_floor(culled: str) -> None:
    cell = Cell(load_trial(text=f"{DROP}cellwright: {{collision_culling: {culled}}}"), competition=False)
    cell.competition.start()
    names = [f"populate_conveyor|disk_part_clone_{k}" for k in range(3)]
    # the first part has its middle over the edge after 1.7 m at 0.2 m/s
    cell.simulation.step_until(8_300_000_000)
    assert cell.parts.pose(cell.parts.part(names[0])).position[2] == pytest.approx(0.5, abs=2e-3)
    cell.simulation.step_until(20_000_000_000)
    assert cell.parts.in_play == {*names}
    for name in names:
        x, y, z = cell.parts.pose(cell.parts.part(name)).position
        assert math.hypot(x, y + 1.0) < 0.5
        assert z < 0.1
    if cell.culling is not None:
        assert not cell.culling.passengers
    assert cell.bus.call("/ariac/table", AGVControlRequest(kit_type="order_0_kit_0")).success
    cell.simulation.step_until(21_000_000_000)
    (fate,) = cell.competition.fates()["order_0_kit_0"]
    assert fate is not None
    assert fate.sentence() == "never gripped; 3 of its type fell off the belt"


@pytest.mark.parametrize(("slower", "faster"), [("belt", "back"), ("back", "belt")])
def test_each_of_several_belts_has_services_of_its_own(slower: str, faster: str) -> None:
    cell = Cell(with_belts(*OPPOSITE, base=replace(ALONE, sensors=())), competition=False)
    request = ConveyorBeltControlRequest(state=ConveyorBeltState(power=30.0))
    cell.bus.call(f"/ariac/conveyor_{slower}/control", request)
    assert (cell.conveyors[slower].power, cell.conveyors[faster].power) == (30.0, 0.0)
    cell.bus.call(f"/ariac/population_{slower}/control", PopulationControlRequest(action="resume"))
    assert (cell.populations[slower].running, cell.populations[faster].running) == (True, False)
    assert "/ariac/conveyor/control" not in {each.name for each in cell.bus.services()}


def test_clones_of_second_belt_go_on_from_those_of_the_first() -> None:
    cell = Cell(with_belts(*OPPOSITE, base=replace(ALONE, has_arm=False, sensors=())), competition=False)
    cell.competition.start()
    cell.simulation.step_until(1_100_000_000)
    names = {f"populate_conveyor|gear_part_clone_{number}" for number in (0, 16)}
    assert cell.parts.in_play == names


def test_parts_for_unknown_belt_are_refused_with_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="back"):
        Cell(replace(with_belts(*OPPOSITE), belt_parts=(replace(RIDERS[0], belt="bck"),)))


def test_fixed_tray_reports_is_submitted_and_takes_the_kit_out() -> None:
    cell = Cell(FIXED, competition=False)
    cell.competition.start()
    cell.simulation.step_until(1_100_000_000)
    assert [each.name for each in cell.trays[1].contents] == [GEAR.name]
    assert cell.bus.call("/ariac/table", AGVControlRequest(kit_type=KIT.kit_type)).success
    assert not cell.bus.call("/ariac/table", AGVControlRequest(kit_type=KIT.kit_type)).success
    assert cell.senders["table"].state == "preparing_to_deliver"
    cell.simulation.step_until(2_000_000_000)
    assert cell.competition.score().total == 3.0
    assert cell.trays[1].contents == ()
    assert GEAR.name not in cell.parts.in_play
    assert cell.bus.call("/ariac/table", AGVControlRequest(kit_type="order_0_kit_1")).success


def test_kit_of_another_tray_than_its_own_scores_nothing() -> None:
    cell = Cell(FIXED, competition=False)
    cell.competition.start()
    cell.simulation.step_until(1_100_000_000)
    other = cell.bus.call("/ariac/submit_tray", SubmitTrayRequest(cell.trays[2].link, KIT.kit_type))
    assert (other.success, other.inspection_result) == (True, 0.0)
    own = cell.bus.call("/ariac/submit_tray", SubmitTrayRequest(cell.trays[1].link, KIT.kit_type))
    assert (own.success, own.inspection_result) == (True, 3.0)


def test_material_locations_tell_trays_and_the_tray_of_a_kit() -> None:
    cell = Cell(FIXED)

    def units(material: str) -> list[str]:
        response = cell.bus.call("/ariac/material_locations", GetMaterialLocationsRequest(material))
        return [each.unit_id for each in response.storage_units]

    assert units("gear_part") == ["bin1"]
    assert units(KIT.kit_type) == ["table"]
    assert units("order_9_kit_0") == []
