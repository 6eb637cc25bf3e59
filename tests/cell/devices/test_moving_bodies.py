"""Table of moving bodies: what it says of times and levers holds for the joints' true motion."""

import math
from itertools import product

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.moving_bodies import EXCESS, MARGIN, Ends, Movers, MovingBodies, end_of_belt
from cellwright.engine.bounding_boxes import Mask, gaps
from cellwright.engine.sleeping_groups import Groups, SleepingGroups
from cellwright.mechanism.welds import add_weld, grip_name
from tests.cell.devices.floor import Floor, named, one_of_each
from tests.support.places import BELT

BELT_SPEED = 0.2
GEAR = named("gear_part")


class Table:
    """The table of a cell in which the arm and some parts are awake."""

    def __init__(self, *loose: str) -> None:
        self.floor = Floor(one_of_each()).reset()
        self.model, self.data = self.floor.model, self.floor.simulation.data
        self.belt = int(self.model.geom_bodyid[self.model.geom(BELT.body).id])
        self.moving = MovingBodies(self.model, {self.belt: BELT.direction})
        arm = int(self.model.body_treeid[self.model.body("vacuum_gripper_link").id])
        self.is_awake: Mask = np.zeros(self.model.ntree, dtype=np.bool_)
        self.is_awake[[arm, *(int(self.model.body_treeid[self.floor.part(name).body]) for name in loose)]] = True
        self.arm_dofs = np.flatnonzero(self.model.dof_treeid == arm)
        sleeping = SleepingGroups(self.model, self.moving.boxes, self.moving.parts, self.moving.links)
        self.groups: Groups = sleeping.find(self.data, self.is_awake)
        self.belt_end = float(sleeping.fixed[self.belt].sides[1, 0])

    def movers(self, passengers: dict[int, int]) -> Movers:
        return self.moving.movers(self.data, self.is_awake, self.groups, passengers, {self.belt: BELT_SPEED})

    def put(self, posture: list[float]) -> None:
        self.data.qpos[self.model.jnt_qposadr[self.model.dof_jntid[self.arm_dofs]]] = posture
        mujoco.mj_kinematics(self.model, self.data)


@pytest.fixture(scope="module")
def table() -> Table:
    return Table(GEAR)


_ANGLE = st.floats(-3.0, 3.0)
_POSTURES = st.lists(_ANGLE, min_size=7, max_size=7)
"""Position or velocity of each joint of the arm and its rail."""


@given(posture=_POSTURES, velocities=_POSTURES, share=st.floats(0.0, 1.0))
def test_times_pass_before_any_link_comes_within_margin(
    table: Table, posture: list[float], velocities: list[float], share: float
) -> None:
    table.put(posture)
    movers = table.movers({})
    speeds = np.zeros(table.model.nv)
    speeds[table.arm_dofs] = velocities
    times = movers.times(movers.sides(table.data), np.abs(speeds[movers.dofs])) + movers.never
    links = slice(0, movers.links)
    within = np.clip(times[links], 0.0, None)
    until = float(within[within > 0.0].min(initial=1.0)) * share
    table.put((np.array(posture) + until * np.array(velocities)).tolist())
    left = gaps(movers.sides(table.data), movers.opposite)[links]
    is_far = np.isfinite(times[links]) & (times[links] > 0.0)
    assert (left[is_far] >= MARGIN - 1e-9).all()


@given(posture=_POSTURES, velocities=_POSTURES)
def test_speeds_bound_those_of_links_with_excess(table: Table, posture: list[float], velocities: list[float]) -> None:
    table.put(posture)
    movers = table.movers({})
    qvel = np.zeros(table.model.nv)
    qvel[table.arm_dofs] = velocities
    speeds = movers.speeds(np.abs(qvel[movers.dofs]))
    before = table.data.xpos[movers.bodies[: movers.links]].copy()
    step = 1e-6
    table.put((np.array(posture) + step * np.array(velocities)).tolist())
    moved = np.linalg.norm(table.data.xpos[movers.bodies[: movers.links]] - before, axis=1) / step
    assert (moved <= speeds[: movers.links] - EXCESS + 1e-3).all()


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
    sides = movers.sides(table.data)
    end = table.belt_end
    sides[:, -1] = (1.2, end + 1.0, 0.95, -1.3, -end - 1.1, -1.0)
    times = movers.times(sides, np.zeros(len(movers.dofs)))
    assert times[-1, count] == np.float64((1.0 - MARGIN) / BELT_SPEED)


@given(yaw=st.floats(-3.0, 3.0), along=st.floats(-9.0, 9.0), across=st.floats(-2.0, 2.0), half=st.floats(0.01, 0.3))
def test_gap_to_end_is_that_of_foremost_corner_along_belt(yaw: float, along: float, across: float, half: float) -> None:
    direction = (math.cos(yaw), math.sin(yaw), 0.0)
    middle = np.array((along * direction[0] - across * direction[1], along * direction[1] + across * direction[0], 1.0))
    sides = np.concatenate([middle - half, -middle - half])[:, None]
    corners = [middle[:2] + half * np.array(signs) for signs in product((-1.0, 1.0), repeat=2)]
    gap = 5.0 - max(float(corner @ direction[:2]) for corner in corners)
    ends = Ends.of([(5.0, direction)])
    assert ends.gaps(sides) == pytest.approx(gap, abs=1e-9)


def test_part_on_no_belt_has_no_end() -> None:
    ends = Ends.of([None, (2.0, (1.0, 0.0, 0.0))])
    assert ends.exist
    assert ends.gaps(np.array([(0.0, 0.0, 0.0, -1.0, -1.0, -1.0)] * 2).T).tolist() == [np.inf, 1.0]
    assert not Ends.of([None]).exist


def test_belt_ends_where_its_box_does(table: Table) -> None:
    assert end_of_belt(table.model, table.belt, BELT.direction) == -table.belt_end == pytest.approx(BELT.end)


def test_open_groups_are_watched_by_passengers_alone(table: Table) -> None:
    gear = table.floor.part(GEAR).body
    movers = table.movers({gear: table.belt})
    movers.watch(np.ones(len(table.groups.boxes), dtype=np.bool_))
    count = len(table.groups.boxes)
    assert np.isinf(movers.watched[: movers.free, :count]).all()
    assert (movers.watched[-1] == movers.never[-1]).all()


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
