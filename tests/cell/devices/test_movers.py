"""Table of moving bodies: its times hold for the joints' true motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.movers import EXCESS, MARGIN
from cellwright.engine.bounding_boxes import facing, gaps, sides_at
from tests.cell.devices.moving_table import BELT_SPEED, GEAR, Table


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
    movers.update(table.data)
    times = movers.times(np.abs(speeds[movers.dofs])) + movers.never
    links = slice(0, movers.links)
    within = np.clip(times[links], 0.0, None)
    until = float(within[within > 0.0].min(initial=1.0)) * share
    table.put((np.array(posture) + until * np.array(velocities)).tolist())
    movers.update(table.data)
    left = gaps(movers.sides, movers.opposite)[links]
    is_far = np.isfinite(times[links]) & (times[links] > 0.0)
    assert (left[is_far] >= MARGIN - 1e-9).all()


@given(posture=_POSTURES, velocities=_POSTURES)
def test_speeds_bound_those_of_links_with_excess(table: Table, posture: list[float], velocities: list[float]) -> None:
    table.put(posture)
    movers = table.movers({})
    qvel = np.zeros(table.model.nv)
    qvel[table.arm_dofs] = velocities
    movers.update(table.data)
    movers.times(np.abs(qvel[movers.dofs]))
    before = table.data.xpos[movers.bodies[: movers.links]].copy()
    step = 1e-6
    table.put((np.array(posture) + step * np.array(velocities)).tolist())
    moved = np.linalg.norm(table.data.xpos[movers.bodies[: movers.links]] - before, axis=1) / step
    assert (moved <= movers.speeds[: movers.links] - EXCESS + 1e-3).all()


@given(posture=_POSTURES, velocities=_POSTURES)
def test_times_are_gaps_less_margin_by_sums_of_speeds(
    table: Table, posture: list[float], velocities: list[float]
) -> None:
    table.put(posture)
    movers = table.movers({table.floor.part(GEAR).body: table.belt})
    speeds = np.zeros(table.model.nv)
    speeds[table.arm_dofs] = velocities
    movers.update(table.data)
    times = movers.times(np.abs(speeds[movers.dofs]))
    centre, half = movers.local
    sides = sides_at(centre, half, table.data.xpos[movers.bodies], table.data.xmat[movers.bodies])
    assert (movers.sides == sides).all()
    assert (movers.opposite[:, -1:] == facing(sides[:, -1:])).all()
    assert movers.speeds[-1] == BELT_SPEED
    expected = gaps(sides, movers.opposite) - MARGIN
    expected[:, :-1] /= movers.speeds[:, None]
    expected[:, -1] /= movers.speeds + BELT_SPEED
    is_end = np.zeros(times.shape, dtype=np.bool_)
    is_end[-1, -2] = True  # whose gap counts along the belt
    assert (times == expected)[~is_end].all()
    assert movers.until_watched(times, 9.0) == min(9.0, (times + movers.watched).min())


def test_open_groups_are_watched_by_passengers_alone(table: Table) -> None:
    gear = table.floor.part(GEAR).body
    movers = table.movers({gear: table.belt})
    movers.watch(np.ones(len(table.groups.boxes), dtype=np.bool_))
    count = len(table.groups.boxes)
    assert np.isinf(movers.watched[: movers.free, :count]).all()
    assert (movers.watched[-1] == movers.never[-1]).all()
