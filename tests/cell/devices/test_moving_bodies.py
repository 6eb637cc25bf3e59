"""Moving bodies: the rows and columns of their table, and the levers of what a weld holds."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.devices.movers import MARGIN
from cellwright.cell.devices.moving_bodies import MovingBodies
from cellwright.mechanism.welds import add_weld, grip_name
from tests.cell.devices.moving_table import BELT_SPEED, GEAR, Table
from tests.support.places import BELT


@pytest.fixture(scope="module")
def table() -> Table:
    return Table(GEAR)


def test_rows_are_links_then_loose_parts_then_passengers(table: Table) -> None:
    gear = table.floor.part(GEAR).body
    alone, riding = table.movers({}), table.movers({gear: table.belt})
    assert alone.bodies.tolist() == [*alone.bodies[: alone.links].tolist(), gear]
    assert (alone.links, alone.free) == (riding.links, riding.free + 1)
    assert riding.bodies.tolist() == alone.bodies.tolist()
    assert riding.carriers[-1] == table.belt
    assert alone.opposite.shape[1] + 1 == riding.opposite.shape[1]


def test_passenger_of_belt_ignores_belt_and_meets_its_end(table: Table) -> None:
    gear = table.floor.part(GEAR).body
    movers = table.movers({gear: table.belt})
    count = len(table.groups.boxes)
    is_belt = table.groups.fixed_body == table.belt
    assert np.isinf(movers.never[-1, :count][is_belt]).all()
    assert movers.never[-1, count] == 0.0
    assert np.isinf(movers.never[: movers.links, count]).all()
    movers.update(table.data)
    end = table.belt_end
    movers.sides[:, -1] = (1.2, end + 1.0, 0.95, -1.3, -end - 1.1, -1.0)
    times = movers.times(np.zeros(len(movers.dofs)))
    assert times[-1, count] == np.float64((1.0 - MARGIN) / BELT_SPEED)


def test_belt_ends_where_its_box_does(table: Table) -> None:
    assert table.moving.ends[table.belt].coordinate == -table.belt_end == pytest.approx(BELT.end)


def test_part_on_a_frame_without_shapes_moves_with_the_joints_behind_it() -> None:
    spec = mujoco.MjSpec()
    upper = spec.worldbody.add_body(name="upper")
    upper.add_joint(name="shoulder")
    upper.add_geom(size=(0.1, 0.1, 0.1), type=mujoco.mjtGeom.mjGEOM_BOX)
    lower = upper.add_body(name="lower", pos=(0.0, 0.0, 1.0))
    lower.add_joint(name="elbow")
    lower.add_geom(size=(0.1, 0.1, 0.1), type=mujoco.mjtGeom.mjGEOM_BOX)
    lower.add_body(name="tip", pos=(0.0, 0.0, 0.5))
    part = spec.worldbody.add_body(name="part", pos=(0.0, 0.0, 5.0))
    part.add_freejoint()
    part.add_geom(size=(0.02, 0.02, 0.02), type=mujoco.mjtGeom.mjGEOM_BOX)
    add_weld(spec, grip_name("part"), "tip", "part", 0.004)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.eq_active[0] = 1
    bodies = {name: int(model.body(name).id) for name in ("upper", "lower", "tip", "part")}
    moving = MovingBodies(model, {})
    assert moving.carrier(data, bodies["part"]) == bodies["tip"]
    relative = moving.relative_levers(data, bodies["part"], bodies["tip"], [bodies["upper"], bodies["lower"]])
    shoulder, elbow = (int(model.joint(name).dofadr[0]) for name in ("shoulder", "elbow"))
    assert relative[0, elbow] >= 0.5 + 0.02
    assert relative[1, elbow] == relative[0, shoulder] == 0.0
