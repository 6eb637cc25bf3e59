"""Table of moving bodies: what it says of times and levers holds for the joints' true motion."""

import mujoco
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.moving_bodies import EXCESS, MARGIN, Movers, MovingBodies
from cellwright.cell.model.furniture import BELT_GEOM
from cellwright.engine.bounding_boxes import Mask, gaps
from cellwright.engine.sleeping_groups import Groups, SleepingGroups
from tests.cell.devices.floor import Floor, named, one_of_each

BELT_SPEED = 0.2
GEAR = named("gear_part")


class Table:
    """The table of a cell in which the arm and some parts are awake."""

    def __init__(self, *loose: str) -> None:
        self.floor = Floor(one_of_each()).reset()
        self.model, self.data = self.floor.model, self.floor.simulation.data
        self.belt = int(self.model.geom_bodyid[self.model.geom(BELT_GEOM).id])
        self.moving = MovingBodies(self.model, self.belt)
        arm = int(self.model.body_treeid[self.model.body("vacuum_gripper_link").id])
        self.is_awake: Mask = np.zeros(self.model.ntree, dtype=np.bool_)
        self.is_awake[[arm, *(int(self.model.body_treeid[self.floor.part(name).body]) for name in loose)]] = True
        self.arm_dofs = np.flatnonzero(self.model.dof_treeid == arm)
        sleeping = SleepingGroups(self.model, self.moving.boxes, self.moving.parts, self.moving.links)
        self.groups: Groups = sleeping.find(self.data, self.is_awake)
        self.belt_end = float(sleeping.fixed[self.belt].sides[1, 0])

    def movers(self, passengers: dict[int, int]) -> Movers:
        return self.moving.movers(
            self.data, self.is_awake, self.groups, passengers, belt_end=self.belt_end, belt_speed=BELT_SPEED
        )

    def put(self, posture: list[float]) -> None:
        self.data.qpos[self.model.jnt_qposadr[self.model.dof_jntid[self.arm_dofs]]] = posture
        mujoco.mj_kinematics(self.model, self.data)


TABLE = Table(GEAR)
_ANGLE = st.floats(-3.0, 3.0)
_POSTURES = st.lists(_ANGLE, min_size=len(TABLE.arm_dofs), max_size=len(TABLE.arm_dofs))


@given(posture=_POSTURES, velocities=_POSTURES, share=st.floats(0.0, 1.0))
def test_times_pass_before_any_link_comes_within_margin(
    posture: list[float], velocities: list[float], share: float
) -> None:
    TABLE.put(posture)
    movers = TABLE.movers({})
    speeds = np.zeros(TABLE.model.nv)
    speeds[TABLE.arm_dofs] = velocities
    times = movers.times(movers.sides(TABLE.data), np.abs(speeds[movers.dofs])) + movers.never
    links = slice(0, movers.links)
    within = np.clip(times[links], 0.0, None)
    until = float(within[within > 0.0].min(initial=1.0)) * share
    TABLE.put((np.array(posture) + until * np.array(velocities)).tolist())
    left = gaps(movers.sides(TABLE.data), movers.opposite)[links]
    is_far = np.isfinite(times[links]) & (times[links] > 0.0)
    assert (left[is_far] >= MARGIN - 1e-9).all()


@given(posture=_POSTURES, velocities=_POSTURES)
def test_speeds_bound_those_of_links_with_excess(posture: list[float], velocities: list[float]) -> None:
    TABLE.put(posture)
    movers = TABLE.movers({})
    qvel = np.zeros(TABLE.model.nv)
    qvel[TABLE.arm_dofs] = velocities
    speeds = movers.speeds(np.abs(qvel[movers.dofs]))
    before = TABLE.data.xpos[movers.bodies[: movers.links]].copy()
    step = 1e-6
    TABLE.put((np.array(posture) + step * np.array(velocities)).tolist())
    moved = np.linalg.norm(TABLE.data.xpos[movers.bodies[: movers.links]] - before, axis=1) / step
    assert (moved <= speeds[: movers.links] - EXCESS + 1e-3).all()


def test_rows_are_links_then_loose_parts_then_passengers() -> None:
    gear = TABLE.floor.part(GEAR).body
    alone, riding = TABLE.movers({}), TABLE.movers({gear: TABLE.belt})
    assert alone.bodies.tolist() == [*alone.bodies[: alone.links].tolist(), gear]
    assert (alone.links, alone.free) == (riding.links, riding.free + 1)
    assert riding.bodies.tolist() == alone.bodies.tolist()
    assert riding.carriers[-1] == TABLE.belt
    assert alone.opposite.shape[1] + 1 == riding.opposite.shape[1]


def test_passenger_of_belt_ignores_belt_and_meets_its_end() -> None:
    gear = TABLE.floor.part(GEAR).body
    movers = TABLE.movers({gear: TABLE.belt})
    count = len(TABLE.groups.boxes)
    is_belt = TABLE.groups.fixed_body == TABLE.belt
    assert np.isinf(movers.never[-1, :count][is_belt]).all()
    assert movers.never[-1, count] == 0.0
    assert np.isinf(movers.never[: movers.links, count]).all()
    sides = movers.sides(TABLE.data)
    sides[:, -1] = (1.2, TABLE.belt_end + 1.0, 0.95, -1.3, -TABLE.belt_end - 1.1, -1.0)
    times = movers.times(sides, np.zeros(len(movers.dofs)))
    assert times[-1, count] == np.float64((1.0 - MARGIN) / BELT_SPEED)


def test_open_groups_are_watched_by_passengers_alone() -> None:
    gear = TABLE.floor.part(GEAR).body
    movers = TABLE.movers({gear: TABLE.belt})
    movers.watch(np.ones(len(TABLE.groups.boxes), dtype=np.bool_))
    count = len(TABLE.groups.boxes)
    assert np.isinf(movers.watched[: movers.free, :count]).all()
    assert (movers.watched[-1] == movers.never[-1]).all()
