"""Control of an arm by requests, without a cell: the joints follow at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.control import LEAD, LIFE, ArmControl, Guard, Mode
from cellwright.clients.agents.operator.pace import JOINT_SPEED, SLIDE_SPEED, TOOL_SPEED
from cellwright.clients.agents.operator.requests import JointVelocity, ToJoints, ToPose, Velocity
from cellwright.clients.agents.operator.tool_arms import OperatedArm, operated_arms
from cellwright.clients.client.client import Client
from cellwright.motion.paths import angle_between
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, Vector3
from tests.cell.arm_cells import carried_cell
from tests.support.cells import ARM_ONLY, INITIAL

PERIOD = 0.02
ZERO = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def arm() -> OperatedArm:
    return operated_arms(Client.in_process(Cell(ARM_ONLY)))[0]


class Bench:
    """An arm whose joints are where they are sent."""

    def __init__(self, arm: OperatedArm, guard: Guard | None = None) -> None:
        self.control = ArmControl(arm, INITIAL, guard)
        self.q = list(INITIAL)
        self.time = 0.0
        self.largest = [0.0] * len(self.q)
        """Largest step of each joint."""

    @property
    def tool(self) -> Pose:
        return self.control.arm.world_T_tool(self.q)

    def step(self, drift: Vector3 = ZERO) -> bool:
        """Let a period pass; return whether the arm was sent anywhere."""
        self.control.see(self.q)
        found = self.control.step(self.time, PERIOD, drift)
        self.time += PERIOD
        if found is not None:
            self.largest = [max(most, abs(b - a)) for most, a, b in zip(self.largest, self.q, found, strict=True)]
            self.q = found
        return found is not None

    def until_rest(self, seconds: float = 20.0) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.step()
            if self.control.mode in (Mode.IDLE, Mode.BLOCKED):
                return
        raise AssertionError(f"still {self.control.mode}: {self.control.why}")

    def stand_up(self) -> None:
        """Turn the tool upright, where it is."""
        self.control.take(ToPose(self.tool), self.time)
        self.until_rest()

    def moved(self, by: Vector3, angles: Vector3 = ZERO) -> Pose:
        """Return the tool's pose, moved and turned in the world."""
        tool = self.tool
        x, y, z = (a + b for a, b in zip(tool.position, by, strict=True))
        return Pose((x, y, z), (Pose.from_rpy(ZERO, angles) @ Pose(ZERO, tool.quaternion)).quaternion)


def test_tool_goes_to_a_pose_within_its_speeds(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.is_upright = False
    goal = bench.moved((0.1, 0.2, 0.1), (0.1, -0.2, 0.3))
    bench.control.take(ToPose(goal), bench.time)
    before = bench.tool
    for _ in range(5):
        bench.step()
        assert math.dist(bench.tool.position, before.position) <= TOOL_SPEED * PERIOD + 1e-6
        before = bench.tool
    assert (bench.control.mode, bench.control.aim) == (Mode.MOVING, goal)
    bench.until_rest()
    assert (bench.control.mode, bench.control.aim) == (Mode.IDLE, None)
    assert bench.tool.position == pytest.approx(goal.position, abs=1e-3)
    assert angle_between(bench.tool, goal) < 2e-3
    assert bench.largest[0] <= SLIDE_SPEED * PERIOD + 1e-9
    assert max(bench.largest[1:]) <= JOINT_SPEED * PERIOD + 1e-9


def test_rail_follows_a_tool_that_goes_far_and_no_other(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.take(ToPose(bench.moved((0.0, 0.05, 0.0))), bench.time)
    bench.until_rest()
    assert bench.q[0] == pytest.approx(0.0, abs=1e-6)
    bench.control.take(ToPose(bench.moved((0.0, 1.5, 0.1))), bench.time)
    bench.until_rest()
    assert bench.control.mode is Mode.IDLE
    assert bench.q[0] > 0.8


def test_pose_out_of_reach_is_reported_and_the_arm_stays_in_its_limits(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.take(ToPose(bench.moved((-3.0, 0.0, 0.0))), bench.time)
    bench.until_rest()
    assert (bench.control.mode, bench.control.why) == (Mode.BLOCKED, "out of reach")
    assert all(lower - 1e-9 <= q <= upper + 1e-9 for q, (lower, upper, _) in zip(bench.q, arm.limits, strict=True))
    bench.control.take(ToPose(bench.moved((0.2, 0.0, 0.0))), bench.time)
    bench.until_rest()
    assert bench.control.mode is Mode.IDLE, "it can go back"


@pytest.mark.parametrize("frame", ["world", "tool"])
def test_velocity_moves_along_the_axes_of_its_frame_and_ends_without_messages(arm: OperatedArm, frame: str) -> None:
    bench = Bench(arm)
    bench.stand_up()
    begin = bench.tool
    for _ in range(50):
        bench.control.take(Velocity((0.0, 0.0, 0.1), ZERO, frame=frame), bench.time)  # type: ignore[arg-type]
        bench.step()
    way = [b - a for a, b in zip(begin.position, bench.tool.position, strict=True)]
    # z of the cup's frame points up while the cup points down
    assert way == pytest.approx([0.0, 0.0, 0.1 * (1.0 - 0.2)], abs=0.012)
    steps = sum(bench.step() for _ in range(50))
    assert steps == pytest.approx(LIFE / PERIOD, abs=1.1)
    assert bench.control.mode is Mode.IDLE


def test_upright_tool_stays_upright_while_it_is_turned(arm: OperatedArm) -> None:
    bench = Bench(arm)
    for _ in range(50):
        bench.control.take(Velocity(ZERO, (0.5, 0.5, 0.5)), bench.time)
        bench.step()
    assert bench.tool.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    bench.control.is_upright = False
    for _ in range(50):
        bench.control.take(Velocity(ZERO, (0.5, 0.0, 0.0)), bench.time)
        bench.step()
    assert bench.tool.rotate((0.0, 0.0, 1.0))[2] < 0.95


def test_joints_go_to_positions_or_at_velocities(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.take(ToJoints({"linear_arm_actuator_joint": 9.0}), bench.time)
    bench.control.take(ToJoints({"wrist_3_joint": 0.5}), bench.time)
    bench.until_rest()
    assert bench.q == pytest.approx([arm.limits[0][1], *INITIAL[1:6], 0.5])
    for _ in range(50):
        bench.control.take(JointVelocity({"wrist_3_joint": -0.5}), bench.time)
        bench.step()
    assert bench.q[6] == pytest.approx(0.1, abs=0.05)
    with pytest.raises(MessageError, match="arm has none of the name tail; give some of linear_arm_actuator_joint"):
        bench.control.take(ToJoints({"tail": 0.0}), bench.time)


def test_home_is_the_first_posture(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.take(ToPose(bench.moved((0.1, 0.5, 0.1))), bench.time)
    bench.until_rest()
    bench.control.go_home()
    assert bench.step()
    assert bench.control.mode is Mode.HOME
    bench.until_rest()
    assert bench.q == pytest.approx(list(INITIAL), abs=1e-6)


def wall(at: float, arm: OperatedArm) -> Callable[..., str]:
    """Return a guard that lets no tool below a height [m]."""
    return lambda _before, after: "the tool would hit the table" if arm.world_T_tool(after).position[2] < at else ""


def test_guard_stops_a_step_and_lets_others_pass(arm: OperatedArm) -> None:
    height = arm.world_T_tool(INITIAL).position[2] - 0.05
    bench = Bench(arm, wall(height, arm))
    bench.control.take(ToPose(bench.moved((0.0, 0.0, -0.2))), bench.time)
    bench.until_rest()
    assert (bench.control.mode, bench.control.why) == (Mode.BLOCKED, "the tool would hit the table")
    assert bench.tool.position[2] == pytest.approx(height, abs=2e-3)
    bench.control.take(ToPose(bench.moved((0.0, 0.0, 0.1))), bench.time)
    bench.until_rest()
    assert bench.control.mode is Mode.IDLE


def test_targets_wait_for_a_joint_that_is_held_up(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.control.take(ToJoints({"wrist_1_joint": INITIAL[4] + 1.0}), 0.0)
    targets = list(INITIAL)
    for number in range(200):
        bench.control.see(INITIAL)  # it does not move
        targets = bench.control.step(number * PERIOD, PERIOD) or targets
    assert LEAD < targets[4] - INITIAL[4] < LEAD + 0.05
    assert bench.control.why == "something keeps it from going on"


def test_arm_that_was_moved_goes_on_from_where_it_is(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.q[6] += 0.5
    bench.control.see(bench.q)
    bench.control.take(JointVelocity({"linear_arm_actuator_joint": 0.1}), 0.0)
    bench.step()
    assert bench.q[6] == pytest.approx(INITIAL[6] + 0.5)


def test_tool_drifts_with_what_moves(arm: OperatedArm) -> None:
    bench = Bench(arm)
    bench.stand_up()
    begin = bench.tool.position
    for _ in range(50):
        bench.step((0.0, -0.2, 0.0))
    assert bench.tool.position == pytest.approx((begin[0], begin[1] - 0.2, begin[2]), abs=5e-3)
    bench.control.take(ToPose(bench.moved((0.1, 0.0, 0.0))), bench.time)
    before = bench.tool.position
    for _ in range(100):
        bench.step((0.0, -0.2, 0.0))
    assert bench.tool.position == pytest.approx((before[0] + 0.1, before[1] - 0.4, before[2]), abs=0.01)
    bench.step()
    bench.until_rest()


def test_arm_without_a_place_moves_along_its_own_axes_alone() -> None:
    arm = next(each for each in operated_arms(Client.in_process(Cell(carried_cell()))) if not each.has_place)
    control = ArmControl(arm, [0.0, -1.2, 1.6, -2.0, -1.57, 0.0])
    with pytest.raises(MessageError, match="small: it stands on a link that moves"):
        control.take(ToPose(Pose()), 0.0)
    with pytest.raises(MessageError, match="its place in the world is unknown"):
        control.take(Velocity((0.1, 0.0, 0.0), ZERO), 0.0)
    control.is_upright = False
    control.take(Velocity((0.1, 0.0, 0.0), ZERO, "tool"), 0.0)
    assert control.step(0.0, PERIOD) is not None
