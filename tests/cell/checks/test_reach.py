"""Reach over surfaces, compared with the solvers point by point."""

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.cell.checks.reach import CLEARANCE, Reach, in_reach, reaches, share_out_of_reach
from cellwright.cell.checks.surfaces import points_on, surfaces_in
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.mechanism.mounted_arm import MountedArm, mounted_arm
from cellwright.motion.chain import Chain, ChainJoint
from cellwright.motion.mounts import FixedMount
from cellwright.util.pose import Pose
from tests.cell.arm_cells import ARMS, ur5_cell
from tests.cell.checks.odd import SMALL, bin_at, trial_with
from tests.support.places import LAYOUT

FOUND = surfaces_in(Trial("", layout=LAYOUT))
ORIGINAL = Reach(mounted_arm(LAYOUT.arms[0], {}))
UR5 = reaches(ur5_cell())[0]
ROUNDING = 0.0035
"""Largest distance [m] to which rounding moves a point, and a little more."""


def tool_down(point: NDArray[np.float64], yaw: float = 0.0) -> Pose:
    x, y, z = point.tolist()
    return Pose.from_rpy((x, y, z + CLEARANCE), (math.pi, 0.0, yaw))


def is_reached(arm: MountedArm, point: NDArray[np.float64], yaw: float) -> bool:
    """Return whether the solver has a posture, from some place of the mount."""
    tool = tool_down(point, yaw)
    return any(
        next(arm.solver.branches(place.world_T_base.inverse() @ tool, arm.home), None) is not None
        for place in arm.mount.places(tool, arm.position)
    )


@settings(max_examples=40)
@given(
    arm=st.sampled_from([ORIGINAL, UR5]),
    point=st.tuples(st.floats(-1.5, 1.5), st.floats(-3.4, 3.4), st.floats(0.3, 1.0)).map(np.array),
    yaw=st.floats(-3.0, 3.0),
)
def test_reach_is_that_of_the_solver(arm: Reach, point: NDArray[np.float64], yaw: float) -> None:
    around = [
        is_reached(arm.arm, point + step, yaw) for step in ROUNDING * np.array([[0, 0, 0], *np.eye(3), *-np.eye(3)])
    ]
    if all(around) or not any(around):
        assert bool(arm.mask(point)) == around[0]


@settings(max_examples=20)
@given(st.sampled_from([ORIGINAL, UR5]), st.floats(0.0, 1.4), st.floats(-math.pi, math.pi))
def test_postures_bring_the_tool_to_the_point(arm: Reach, distance: float, direction: float) -> None:
    point = np.array((distance * math.cos(direction), distance * math.sin(direction), 0.6))
    for posture in islice(arm.postures(point), 10):
        place = next(
            each for each in arm.arm.mount.places(tool_down(point), posture.position) if each[0] == posture.position
        )
        tool = place.world_T_base @ arm.arm.chain.tool(posture.q)
        assert math.dist(tool.position, point + np.array((0.0, 0.0, CLEARANCE))) < ROUNDING
        assert tool.rotate((0.0, 0.0, 1.0))[2] == pytest.approx(-1.0, abs=1e-9)
        assert arm.arm.solver.margin(posture.q).limit >= 0.0
        assert all(posture.q[:-1] == other.q[:-1] for other in arm.yaws(posture))
        assert len({round(other.q[-1], 6) for other in (posture, *arm.yaws(posture))}) == 8


def test_limits_of_the_pan_axis_leave_a_wedge_out_of_reach() -> None:
    arm = UR5.arm
    pan = replace(arm.chain.joints[0], lower=-1.0, upper=1.0)
    narrow = replace(arm, chain=replace(arm.chain, joints=(pan, *arm.chain.joints[1:])))
    turns = np.linspace(-math.pi, math.pi, 73)
    circle = np.stack([0.5 * np.cos(turns), 0.5 * np.sin(turns), np.full(73, 0.45)], axis=1)
    assert UR5.mask(circle).all()
    expected = [is_reached(narrow, point, 0.0) for point in circle]
    assert 10 < sum(expected) < 60
    assert Reach(narrow).mask(circle).tolist() == expected


def gantry() -> MountedArm:
    """A gantry, whose tool points down and cannot turn."""
    names = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    joints = tuple(
        ChainJoint(name, axis, (0.0, 0.0, 0.0), is_prismatic=True, lower=-0.5, upper=0.5)
        for name, axis in names.items()
    )
    chain = Chain(joints, Pose.from_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0)))
    return MountedArm("gantry", chain, (0.0, 0.0, 0.0), FixedMount(Pose((0.0, 0.0, 1.0))), "", 0.0)


def test_arm_without_a_pan_axis_is_solved_point_by_point() -> None:
    reach = Reach(gantry())
    assert not reach.is_quick
    assert ORIGINAL.is_quick
    points = np.array([(0.49, -0.49, 0.7), (0.0, 0.0, 0.2), (0.6, 0.0, 0.7)])
    assert reach.mask(points).tolist() == [True, False, False]
    (posture,) = reach.postures(points[0])
    assert posture.q == pytest.approx((0.49, -0.49, -0.28), abs=1e-5)
    assert not [*reach.yaws(posture)]


def test_arm_without_a_closed_form_has_reach() -> None:
    text = f"""
cell:
  arms: {{arm: {{model: {ARMS / "xarm7.urdf"}, mount: {{kind: pedestal, at: [0, 0, 0.5]}}, tip: link7,
    home: {{joint2: -0.4, joint4: 1.0, joint6: 1.2}}}}}}
  bins: {{near: {{at: [0.45, 0], size: [0.2, 0.2], surface: 0.45}}, far: {{at: [2, 0], surface: 0.45}}}}
"""
    trial = load_trial(text=text).trial
    near, far = surfaces_in(trial)
    arms = reaches(trial)
    assert share_out_of_reach(near, arms) == 0.0
    assert share_out_of_reach(far, arms) == 1.0


def test_reach_moves_with_the_cell() -> None:
    moved = LAYOUT.moved(Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, math.pi / 2)))
    elsewhere = Reach(mounted_arm(moved.arms[0], {}))
    for one, other in zip(FOUND, surfaces_in(Trial("", layout=moved)), strict=True):
        assert share_out_of_reach(one, [ORIGINAL]) == pytest.approx(share_out_of_reach(other, [elsewhere]), abs=0.02)


def test_share_of_a_belt_is_of_its_width() -> None:
    belt = next(each for each in FOUND if each.is_belt)
    assert share_out_of_reach(belt, [ORIGINAL]) == 0.0
    assert 0.3 < in_reach(belt, [ORIGINAL]).mean() < 0.5


def test_point_is_out_of_reach_only_if_no_arm_reaches_it() -> None:
    surface = surfaces_in(ur5_cell())[0]
    far = Reach(replace(UR5.arm, mount=FixedMount(Pose((9.0, 0.0, 0.5)))))
    assert not in_reach(surface, [far]).any()
    assert in_reach(surface, [far, UR5]).all()
    assert in_reach(surface, [UR5, far]).all()
    assert in_reach(surface, [far, UR5]).shape == points_on(surface).shape[:2]


def test_far_bin_is_out_of_reach() -> None:
    trial = trial_with(replace(SMALL, bins=(bin_at("far", -3.0, 0.0),)))
    assert share_out_of_reach(surfaces_in(trial)[0], reaches(trial)) == 1.0
