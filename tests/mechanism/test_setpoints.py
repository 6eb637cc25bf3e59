"""Setpoints of servos: batches must not show."""

from fractions import Fraction

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.simulation import Simulation
from cellwright.mechanism.joint_trajectory import JointTrajectory
from cellwright.mechanism.setpoints import MAX_BATCH, MAX_SETPOINT, Setpoints
from tests.mechanism.trajectories import JOINTS, SECOND, commands, controller, to

RATE = 500
_BODY = '<body><joint name="{0}" type="slide"/><geom size="0.1"/>'
_SERVO = '<general name="{0}" joint="{0}"/><general name="{0} velocity" joint="{0}"/>'


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    """Return a simulation whose servos have an input each, in pairs of position and velocity."""
    bodies = "".join(_BODY.format(name) for name in JOINTS) + "</body>" * len(JOINTS)
    servos = "".join(_SERVO.format(name) for name in JOINTS)
    xml = f"<mujoco><worldbody>{bodies}</worldbody><actuator>{servos}</actuator></mujoco>"
    return Simulation(mujoco.MjModel.from_xml_string(xml), timestep=Fraction(1, RATE))


def inputs(simulation: Simulation) -> list[list[float]]:
    """Return the servos' inputs as rows of position and velocity."""
    rows: list[list[float]] = simulation.data.ctrl.reshape(-1, 2).tolist()
    return rows


@given(
    st.lists(st.tuples(commands(), st.integers(1, 3 * MAX_BATCH)), min_size=1, max_size=4),
    st.sets(st.integers(0, 3 * MAX_BATCH)),
)
def test_setpoints_equal_desired_state_of_each_tick(
    simulation: Simulation, steps: list[tuple[JointTrajectory, int]], jumps: set[int]
) -> None:
    """Whatever the batches, the commands and the jumps of time."""
    setpoints, followed, tick = Setpoints(simulation, JOINTS), controller(), 0
    time_of = simulation.clock.time_of
    for command, count in steps:
        followed.command(command, time_of(tick))
        for _ in range(count):
            tick += 7 if tick in jumps else 1
            simulation.clock.set_tick(tick)
            setpoints.write(followed.trajectory)
            expected = zip(followed.positions(time_of(tick)), followed.velocities(time_of(tick + 1)), strict=True)
            assert inputs(simulation) == [list(pair) for pair in expected]


def test_setpoints_follow_same_trajectory_from_another_departure(simulation: Simulation) -> None:
    followed = controller()
    followed.command(to([1.0] * 7), 0)
    setpoints = Setpoints(simulation, JOINTS, origin=[0.5] * 7)
    for departure in (0, 3 * SECOND):
        simulation.clock.set_tick(RATE * 7 // 2)
        setpoints.write(followed.trajectory, departure)
        expected = followed.positions(SECOND * 7 // 2 - departure)
        assert [row[0] for row in inputs(simulation)] == [place - 0.5 for place in expected]


def test_setpoints_beyond_limit_are_limited(simulation: Simulation) -> None:
    followed = controller()
    followed.command(to([1e300] * 7, [-1e300] * 7), 0)
    setpoints = Setpoints(simulation, JOINTS)
    for tick in range(2 * RATE):
        simulation.clock.set_tick(tick)
        setpoints.write(followed.trajectory)
        assert np.abs(simulation.data.ctrl).max() <= MAX_SETPOINT


def test_setpoints_at_rest_are_origin(simulation: Simulation) -> None:
    setpoints = Setpoints(simulation, JOINTS, origin=[2.0] * 7)
    setpoints.hold([3.0] * 7)
    assert inputs(simulation) == [[1.0, 0.0]] * 7
