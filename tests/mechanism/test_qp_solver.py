import math

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cellwright.mechanism.qp_solver import QpSolver
from cellwright.motion.chain import Chain, ChainJoint
from cellwright.motion.solver import MAX_STEP, largest_step, travel
from cellwright.motion.ur_solver import UrSolver, ur_form
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.motion.arms import arm, error, within

UR5, HOME = arm("ur5")
SOLVER = QpSolver(UR5, HOME)
HOME_POSE = UR5.tool(HOME)
NO_SHRINKING = (Phase.explicit, Phase.generate)  # an example takes too long


def planar(*, limit: float = 2.5) -> Chain:
    """Return a gantry with a slide and two joints about vertical axes, for poses in a plane."""
    return Chain(
        (
            ChainJoint("slide", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), is_prismatic=True, lower=-0.5, upper=0.5, speed=0.5),
            ChainJoint("first", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), lower=-limit, upper=limit, speed=1.0),
            ChainJoint("second", (0.0, 0.0, 1.0), (0.4, 0.0, 0.0), speed=1.0),
        ),
        Pose((0.7, 0.0, 0.1)),
    )


@given(within(UR5, 3.1), within(UR5, 6.2))
@settings(max_examples=8, phases=NO_SHRINKING)
def test_branches_bring_tool_to_pose_within_limits(q: tuple[float, ...], near: tuple[float, ...]) -> None:
    target = UR5.tool(q)
    postures = list(SOLVER.branches(target, near))
    for posture in postures:
        assert error(UR5, posture, target) < 2e-6
        assert all(abs(value) <= 2 * math.pi for value in posture)
    distances = [travel(each, near, SOLVER.speed) for each in postures[1:]]
    assert distances == sorted(distances)


def test_first_branch_is_nearest_and_others_are_those_of_closed_form() -> None:
    form = ur_form(UR5)
    assert form is not None
    target = UR5.tool((0.4, -1.0, 1.3, -1.8, -1.2, 0.5))
    exact = list(UrSolver(UR5, form, HOME).branches(target, HOME))
    found = list(SOLVER.branches(target, HOME))
    assert found[0] == pytest.approx(exact[0], abs=1e-4)
    assert 2 * len(found) >= len(exact)
    for posture in found:
        assert min(largest_step(posture, each) for each in exact) < 1e-4


def test_branches_are_repeatable_and_distinct() -> None:
    target = UR5.tool((0.4, -1.0, 1.3, -1.8, -1.2, 0.5))
    found = list(SOLVER.branches(target, HOME))
    assert list(QpSolver(UR5, HOME).branches(target, HOME)) == found
    for place, posture in enumerate(found):
        assert all(largest_step(posture, other) > 0.04 for other in found[:place])


@given(st.floats(-0.4, 0.4), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
@settings(max_examples=10, phases=NO_SHRINKING)
def test_slide_is_solved_like_any_joint(slide: float, first: float, second: float) -> None:
    chain = planar()
    solver = QpSolver(chain, (0.0, 0.5, 0.5))
    target = chain.tool((slide, first, second))
    postures = list(solver.branches(target, (slide, first, second)))
    assert postures[0] == pytest.approx((slide, first, second), abs=1e-4)
    for posture in postures:
        assert error(chain, posture, target) < 2e-6
        assert -0.5 <= posture[0] <= 0.5
        assert abs(posture[1]) <= 2.5


def test_joint_without_limits_turns_on() -> None:
    chain = planar()
    near = (0.1, 0.3, 9.0)
    assert next(QpSolver(chain, (0.0, 0.5, 0.5)).branches(chain.tool(near), near)) == pytest.approx(near, abs=1e-5)


def test_pose_out_of_reach_has_no_branches() -> None:
    for x in (5.0, 0.95):  # beyond the sum of all lengths, and within it
        target = Pose((x, 0.0, 0.3), HOME_POSE.quaternion)
        assert list(SOLVER.branches(target, HOME)) == []
        assert SOLVER.step_to(target, HOME) is None


def test_step_is_small_or_refused() -> None:
    solver = SOLVER
    x, y, z = HOME_POSE.position
    near = solver.step_to(Pose((x + 0.02, y, z), HOME_POSE.quaternion), HOME)
    assert near is not None
    assert 0.0 < largest_step(near, HOME) <= MAX_STEP
    assert solver.step_to(Pose((x - 0.4, y, z), HOME_POSE.quaternion), HOME) is None


def test_number_that_is_not_finite_is_refused() -> None:
    with pytest.raises(UsageError, match="finite"):
        next(SOLVER.branches(Pose((math.nan, 0.0, 0.0)), HOME))
    with pytest.raises(UsageError, match="finite"):
        SOLVER.step_to(HOME_POSE, (math.inf, *HOME[1:]))


def test_quaternion_of_any_length_is_taken() -> None:
    w, x, y, z = HOME_POSE.quaternion
    longer = Pose(HOME_POSE.position, (2 * w, 2 * x, 2 * y, 2 * z))
    assert SOLVER.step_to(longer, HOME) == pytest.approx(HOME, abs=1e-5)
