"""Fixed trays: submitted, taken out and ready again where they stand."""

from dataclasses import replace

import pytest

from cellwright.cell.devices.kit_sender import PREPARATION, FixedTray, KitSender
from cellwright.config.layout.layout import Tray
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose
from tests.cell.devices.floor import Floor
from tests.support.places import LAYOUT

TABLE = Tray(3, "table", Pose.from_rpy((-2.5, 0.0, 0.0), (0.0, 0.0, 0.3)), size=(0.4, 0.6), surface=0.6)
GEARS = tuple(
    Part(f"table|gear_part_{n}", "gear_part", Pose((0.05, 0.1 * n, 0.006)), frame=TABLE.tray_link) for n in (1, 2)
)
TRIAL = Trial("fixed", extra_parts=GEARS, layout=replace(LAYOUT, trays=(TABLE,)))


@pytest.fixture
def floor() -> Floor:
    return Floor(TRIAL)


def sender(floor: Floor) -> KitSender:
    return floor.cell.senders["table"]


def test_fixed_tray_is_a_sender_beside_the_agvs(floor: Floor) -> None:
    assert list(floor.cell.senders) == ["agv1", "agv2", "table"]
    assert list(floor.cell.agvs) == [1, 2]
    assert isinstance(sender(floor), FixedTray)
    assert sender(floor).number == 3


def test_tray_reports_parts_in_its_own_frame(floor: Floor) -> None:
    floor.run(1.01)
    found = {each.name: each.pose for each in floor.cell.trays[3].contents}
    assert set(found) == {part.name for part in GEARS}
    for part in GEARS:
        assert found[part.name].position[:2] == pytest.approx(part.pose.position[:2], abs=1e-3)
        assert found[part.name].position[2] == pytest.approx(0.005, abs=1e-4)


def test_sent_kit_is_submitted_after_preparation_and_leaves(floor: Floor) -> None:
    submitted: list[tuple[float, str, int]] = []
    tray = sender(floor)
    tray.on_submit.append(lambda each, kit: submitted.append((floor.now, kit, len(each.tray.contents))))
    floor.run(1.01)
    assert tray.send("kit")
    assert tray.holds_unsent_kit
    assert not tray.send("other")
    floor.run(PREPARATION - 0.01)
    assert not submitted
    floor.run(0.02)
    [(time, kit, count)] = submitted
    assert (kit, count) == ("kit", 2)
    assert time == pytest.approx(1.01 + PREPARATION, abs=0.003)
    assert floor.cell.trays[3].contents == ()
    assert not {part.name for part in GEARS} & floor.cell.parts.in_play
    assert tray.state == "ready_to_deliver"
    assert tray.send("next")


def test_reset_makes_a_tray_ready(floor: Floor) -> None:
    sender(floor).send("kit")
    floor.cell.reset()
    assert (sender(floor).state, sender(floor).kit_type) == ("ready_to_deliver", "")
    floor.run(1.0)
    assert len(floor.cell.trays[3].contents) == 2


def test_part_in_the_cup_is_not_welded_to_a_fixed_tray(floor: Floor) -> None:
    gear = floor.cell.parts.part(GEARS[0].name)
    assert set(gear.locks) == {1, 2}
    floor.cell.trays[3].clear()  # takes out what is locked: nothing
    assert GEARS[0].name in floor.cell.parts.in_play
