import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.motion.solver import TURN_WEIGHT
from cellwright.robot.ee_poses import VELOCITY_SHARE
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.robot.servos import DEFAULT_TURN_SPEED
from cellwright.util.pose import Pose
from tests.robot.bundled import apart, posture_near_home, qinglong, tandem, tips
from tests.robot.robots import two_arms

RIGHT, LEFT = 0, 1


@pytest.fixture(scope="module")
def humanoid() -> RobotNode:
    return RobotNode(qinglong())


@pytest.fixture(scope="module")
def small() -> RobotNode:
    return RobotNode(two_arms())


def run(node: RobotNode, seconds: float, each_tick: Callable[[float], None] = lambda _time: None) -> None:
    """Run for a time, and call something before each tick with the time since the beginning [s]."""
    begin = node.simulation.time
    while node.simulation.time < begin + seconds - 1e-9:
        each_tick(node.simulation.time - begin)
        node.simulation.step()


def errors(node: RobotNode, targets: list[Pose]) -> list[tuple[float, float]]:
    return [apart(there, target) for there, target in zip(node.ee_poses.poses(), targets, strict=True)]


def moved(poses: list[Pose], x: float = 0.0, y: float = 0.0, z: float = 0.0) -> list[Pose]:
    return [Pose((x, y, z)) @ pose for pose in poses]


def joints_of(node: RobotNode, place: int) -> list[int]:
    return [node.commander.numbers[name] for name in node.config.arms[place].joints]


def speed(node: RobotNode) -> float:
    return float(np.abs(node.servos.read().velocities).max())


def weighted_error(tip: Pose, target: Pose) -> float:
    """Return the error that the solver reduces: translation and rotation together [m]."""
    distance, turn = apart(tip, target)
    return math.hypot(distance, TURN_WEIGHT * turn)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_both_tips_of_humanoid_reach_reachable_poses(humanoid: RobotNode, seed: int) -> None:
    humanoid.simulation.reset()
    targets = tips(humanoid.config, posture_near_home(humanoid.config, np.random.default_rng(seed), 1.0))
    humanoid.ee_poses.aim(targets)
    run(humanoid, 1.5)
    for distance, turn in errors(humanoid, targets):
        assert distance < 1e-3
        assert turn < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_arms_on_lift_reach_poses_without_moving_lift(seed: int) -> None:
    node = RobotNode(tandem())
    lift = node.commander.numbers["lift"]
    node.commander.set_targets([lift], [0.1])
    targets = tips(node.config, posture_near_home(node.config, np.random.default_rng(seed), 0.6) | {"lift": 0.1})
    node.ee_poses.aim(targets)
    run(node, 2.0)
    assert np.max(errors(node, targets)) < 1e-3
    assert node.servos.read().positions[lift] == pytest.approx(0.1, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_arm_of_three_joints_reaches_reachable_poses(small: RobotNode, seed: int) -> None:
    small.simulation.reset()
    targets = tips(small.config, posture_near_home(small.config, np.random.default_rng(seed), 0.8))
    small.ee_poses.aim(targets)
    run(small, 2.0)
    assert np.max(errors(small, targets)) < 1e-3


@pytest.mark.slow
def test_pose_step_is_not_overshot(humanoid: RobotNode) -> None:
    humanoid.simulation.reset()
    begin = humanoid.ee_poses.poses()
    humanoid.ee_poses.aim(moved(begin, x=0.1))
    distances: list[float] = []
    run(
        humanoid,
        1.0,
        lambda _: distances.append(humanoid.ee_poses.poses()[RIGHT].position[0] - begin[RIGHT].position[0]),
    )
    assert max(distances) < 0.1 + 2e-4
    assert distances[int(0.3 * 240)] > 0.099


@pytest.mark.slow
def test_circle_is_followed_within_one_centimetre(humanoid: RobotNode) -> None:
    humanoid.simulation.reset()
    begin, radius, pulse = humanoid.ee_poses.poses(), 0.1, 2 * math.pi * 0.25
    found: list[float] = []
    commands = 0

    def on_circle(time: float) -> list[Pose]:
        return moved(begin, x=radius * math.sin(pulse * time), z=radius * (1 - math.cos(pulse * time)))

    def command(time: float) -> None:
        nonlocal commands
        if time >= commands * 0.01:
            humanoid.ee_poses.aim(on_circle(time))
            commands += 1
        if time > 0.5:
            found.append(max(distance for distance, _ in errors(humanoid, on_circle(time))))

    run(humanoid, 4.5, command)
    assert max(found) < 0.011  # 60 ms behind at 0.157 m/s
    assert max(found) - min(found) < 0.002  # and evenly


@pytest.mark.slow
@pytest.mark.parametrize("there", [(0.3, 0.0, 0.6), (0.0, -2.0, 0.5)])
def test_unreachable_pose_is_approached_without_trembling(
    humanoid: RobotNode, there: tuple[float, float, float]
) -> None:
    humanoid.simulation.reset()
    targets = moved(humanoid.ee_poses.poses(), *there)
    humanoid.ee_poses.aim(targets)
    arms = joints_of(humanoid, RIGHT) + joints_of(humanoid, LEFT)
    lower, upper = humanoid.servos.lower[arms], humanoid.servos.upper[arms]
    velocities = []

    def look(_time: float) -> None:
        read = humanoid.servos.read()
        velocities.append(read.velocities[arms])
        assert (read.positions[arms] > lower - 0.01).all()
        assert (read.positions[arms] < upper + 0.01).all()

    run(humanoid, 7.0, look)
    changes = np.abs(np.diff(velocities, axis=0))
    assert changes[-480:].max() < 0.05  # no trembling [rad/s from tick to tick]
    assert np.abs(velocities[-1]).max() < 0.05
    names = [name for arm in humanoid.config.arms for name in arm.joints]
    reached = humanoid.servos.read().positions[arms]
    rng = np.random.default_rng(1)
    for _ in range(20):
        other = np.clip(reached + rng.uniform(-0.03, 0.03, len(arms)), lower, upper)
        around = tips(humanoid.config, dict(zip(names, other.tolist(), strict=True)))
        for tip, near, target in zip(humanoid.ee_poses.poses(), around, targets, strict=True):
            assert weighted_error(near, target) > 0.995 * weighted_error(tip, target)


def test_joint_command_ends_pose_motion_of_its_arm_only(small: RobotNode) -> None:
    small.simulation.reset()
    small.ee_poses.aim(moved(small.ee_poses.poses(), x=0.05))
    run(small, 0.1)
    small.commander.set_targets([small.commander.numbers["elbow_left"]], [-0.7])
    run(small, 0.1)
    right, left = small.ee_poses.targets
    assert right is not None
    assert left is None
    assert small.commander.limiter.desired[small.commander.numbers["elbow_left"]] == -0.7


def test_joint_command_to_current_target_ends_pose_motion(small: RobotNode) -> None:
    small.simulation.reset()
    small.ee_poses.aim(moved(small.ee_poses.poses(), x=0.05))
    run(small, 0.1)
    chosen = joints_of(small, RIGHT)
    small.commander.set_targets(chosen, small.commander.limiter.desired[chosen])
    run(small, 0.1)
    assert small.ee_poses.targets[RIGHT] is None


@pytest.mark.parametrize("end", ["hold", "stop", "disable", "home"])
def test_hold_stop_disable_and_home_end_pose_motion(small: RobotNode, end: str) -> None:
    small.simulation.reset()
    commander = small.commander
    small.ee_poses.aim(moved(small.ee_poses.poses(), x=0.05))
    run(small, 0.05)
    match end:
        case "hold":
            commander.hold("a test")
        case "stop":
            commander.stop("a test")
        case "disable":
            commander.set_enabled(False)
        case "home":
            small.bus.call("/io_teleop_reset_robot", TriggerRequest())
    run(small, 0.5)
    assert small.ee_poses.targets == (None, None)
    begin = small.servos.read().positions
    run(small, 0.2)
    assert small.servos.read().positions == pytest.approx(begin, abs=1e-3)


@pytest.mark.slow
def test_new_poses_start_from_current_posture(small: RobotNode) -> None:
    small.simulation.reset()
    begin = small.ee_poses.poses()
    chosen = joints_of(small, RIGHT)
    small.commander.set_targets(chosen, [1.5, -1.9, 0.0])
    run(small, 0.1)
    there = small.servos.read().positions[chosen]
    small.ee_poses.aim(begin)
    assert small.commander.limiter.desired[chosen] == pytest.approx(there)
    run(small, 2.0)
    assert np.max(errors(small, begin)) < 1e-3


@pytest.mark.slow
def test_pose_motion_compensates_other_joints_without_moving_them(small: RobotNode) -> None:
    small.simulation.reset()
    begin = small.ee_poses.poses()
    small.ee_poses.aim(begin)
    lift = small.commander.numbers["lift"]
    small.commander.set_targets([lift], [0.05])
    run(small, 2.0)
    assert small.servos.read().positions[lift] == pytest.approx(0.05, abs=1e-6)
    assert [distance for distance, _ in errors(small, begin)] == pytest.approx(
        [0.0, 0.0], abs=0.02
    )  # three joints do not turn and move
    assert small.servos.read().positions[joints_of(small, RIGHT)] != pytest.approx((0.5, -1.0, 0.2), abs=0.05)


def test_pose_subscriber_does_not_change_state() -> None:
    hashes = []
    for listens in (False, True):
        node = RobotNode(two_arms())
        if listens:
            node.bus.subscribe("/io_teleop/state_ee_poses", lambda _: None)
        node.ee_poses.aim(moved(node.ee_poses.poses(), x=0.05))
        run(node, 0.5)
        hashes.append(node.simulation.state_hash())
    assert hashes[0] == hashes[1]


def test_pose_motion_continues_from_snapshot(small: RobotNode) -> None:
    small.simulation.reset()
    small.ee_poses.aim(moved(small.ee_poses.poses(), x=0.05))
    run(small, 0.05)
    snapshot = take_snapshot(small.simulation)
    run(small, 0.2)
    expected = small.simulation.state_hash()
    small.simulation.reset()
    restore_snapshot(small.simulation, snapshot)
    run(small, 0.2)
    assert small.simulation.state_hash() == expected


def test_joint_without_urdf_speed_keeps_servo_speed() -> None:
    config = two_arms()
    joints = tuple(
        replace(joint, limits=replace(joint.limits, velocity=math.inf)) if joint.name == "wrist_right" else joint
        for joint in config.robot.joints
    )
    settings = RobotSettings(safety=SafetySettings(tip_turning=100.0))
    node = RobotNode(replace(config, robot=replace(config.robot, joints=joints)), settings)
    number = node.commander.numbers["wrist_right"]
    right, left = node.ee_poses.poses()
    node.ee_poses.aim([right @ Pose.from_rpy((0.0, 0.0, 0.0), (1.5, 0.0, 0.0)), left])
    fastest, before = 0.0, node.commander.applied[number]
    for _ in range(240):
        node.simulation.step()
        fastest = max(fastest, abs(node.commander.applied[number] - before) * 240.0)
        before = node.commander.applied[number]
    assert before == pytest.approx(1.7, abs=1e-3)
    assert fastest == pytest.approx(VELOCITY_SHARE * DEFAULT_TURN_SPEED, rel=1e-6)
