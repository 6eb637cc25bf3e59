"""Grasps of the scripted lesson, with parts, friction and the gripper's clock varied.

Its waypoints were tuned by hand against the original. They press the cup a few millimetres into a piston rod. On the
running belt the cup meets a gear by the gear's small mark only.
"""

import math
import random
from collections.abc import Sequence

import pytest

from cellwright.clients.agents.lesson import BY_BELT, LIFT, OFF_BELT, ON_BELT, PICK, READY, STEP, WAYPOINTS
from tests.cell.devices.floor import MILLISECOND, MM, Floor, in_order, named, one_of_each
from tests.support.places import BELT_SURFACE, BIN_SURFACE

PISTON, GEAR = named("piston_rod_part"), named("gear_part")
BEAM = 2.25
"""Position of the break beam across the belt: y in the world frame [m]."""


@pytest.fixture(scope="module")
def floor() -> Floor:
    return Floor(one_of_each(), "original")


def waypoint(number: int, **changes: float) -> list[float]:
    values = list(WAYPOINTS[number])
    for joint, value in changes.items():
        values[{"rail": 1, "shoulder_lift": 2}[joint]] = value
    return in_order(values)


def prepare(floor: Floor, part: str, posture: Sequence[float], friction: float, phase: int | None) -> None:
    floor.reset()
    for geom in floor.part(part).geoms:
        floor.model.geom_friction[geom, 0] = friction
    floor.gripper.phase = phase
    floor.put_arm(posture)


def fetch_from_bin(floor: Floor, rng: random.Random, number: int) -> bool:
    """Return whether the lesson gets the first (0) or second (1) piston rod out of bin 7."""
    phase = rng.randrange(100 * MILLISECOND)
    prepare(floor, PISTON, waypoint(READY), rng.uniform(0.6, 1.0), phase)
    x, y = -0.3 + rng.uniform(-6, 6) * MM, 0.03 + 0.133333 * number + rng.uniform(-6, 6) * MM
    floor.lay(PISTON, x, y, BIN_SURFACE, yaw=math.pi / 4, above=0.025)
    floor.run(0.5)
    floor.send(waypoint(PICK, rail=WAYPOINTS[PICK][1] + STEP * number))
    floor.run(1.0)
    floor.gripper.set_enabled(True)
    floor.run(0.2)
    held = floor.gripper.part == PISTON
    floor.send(waypoint(LIFT))
    floor.run(1.0)
    return held and floor.gripper.part == PISTON and floor.pose(PISTON).position[2] > 0.9


def fetch_from_belt(floor: Floor, delay: float, friction: float, phase: int | None) -> str:
    """Grip a gear `delay` [s] after it has broken the beam; return the fault, or empty if it left the belt."""
    prepare(floor, GEAR, waypoint(BY_BELT), friction, phase)
    floor.cell.conveyors["belt"].set_power(100.0)
    floor.lay(GEAR, 1.21, 2.6, BELT_SURFACE)
    floor.run_until(lambda: floor.pose(GEAR).position[1] - 0.0392 <= BEAM, 5.0)
    floor.run(delay)
    floor.gripper.set_enabled(True)
    floor.send(waypoint(ON_BELT, shoulder_lift=-0.66))
    floor.run(1.2)
    if not floor.gripper.attached:
        return floor.gripper.reason
    floor.send(waypoint(OFF_BELT))
    floor.run(1.0)
    return floor.gripper.reason if floor.pose(GEAR).position[2] > 1.05 else "it is still low"


@pytest.mark.slow
def test_scripted_pick_from_bin_grips_piston_rods(floor: Floor) -> None:
    rng = random.Random(20171121)
    grips = [fetch_from_bin(floor, rng, trial % 2) for trial in range(20)]
    assert sum(grips) >= 19  # 20 of 20, and 60 of 60 with another seed


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.3, 0.4, 0.5, 0.6, 0.65])
@pytest.mark.parametrize(
    ("friction", "phase"), [(1.0, None), (0.6, 0), (0.8, 35 * MILLISECOND), (1.0, 98 * MILLISECOND)]
)
def test_scripted_pick_from_running_belt_grips_gear(
    floor: Floor, delay: float, friction: float, phase: int | None
) -> None:
    """The script looks at the beam once a second, which a gear breaks for 0.39 s, and then waits 0.3 s."""
    assert fetch_from_belt(floor, delay, friction, phase) == ""


def test_scripted_pick_from_belt_misses_gear_when_too_late(floor: Floor) -> None:
    assert fetch_from_belt(floor, 1.2, 1.0, None) in ("no contact", "contact with conveyor_belt, which is no part")
