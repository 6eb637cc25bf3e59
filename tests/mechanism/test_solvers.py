"""The table of solvers: which one each arm has, what share of poses it solves, and how exactly."""

import random

import pytest

from cellwright.mechanism.qp_solver import QpSolver
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.solver import MAX_STEP, largest_step
from cellwright.motion.ur_solver import UrSolver
from tests.motion.arms import arm, error, straight_paths

POSES = 10
"""Poses of the tool in random postures."""
ALL = 3
"""Poses of which all branches are looked at."""


@pytest.mark.parametrize(
    ("name", "solver_type", "max_error", "min_branches"),
    [
        ("ur5", UrSolver, 1e-9, 7.0),
        ("ur10", UrSolver, 1e-9, 7.0),
        ("panda", QpSolver, 2e-6, 5.0),
        ("iiwa7", QpSolver, 2e-6, 8.0),
        ("xarm6", QpSolver, 2e-6, 2.0),
        ("xarm7", QpSolver, 2e-6, 7.0),
    ],
)
def test_solver_finds_all_poses(name: str, solver_type: type, max_error: float, min_branches: float) -> None:
    chain, home = arm(name)
    solver, rng = solver_of(chain, home), random.Random(2)
    assert isinstance(solver, solver_type)
    count = 0
    for number in range(POSES):
        q = tuple(rng.uniform(max(joint.lower, -3.1), min(joint.upper, 3.1)) for joint in chain.joints)
        pose = chain.tool(q)
        postures = solver.branches(pose, home)
        first = next(postures, None)
        assert first is not None, q
        # all branches of a few poses: by quadratic programs they take ten times as long as the first
        some = [first, *postures] if number < ALL or solver_type is UrSolver else [first]
        for posture in some:
            assert error(chain, posture, pose) < max_error
            limits = zip(solver.lower, posture, solver.upper, strict=True)
            assert all(low - 1e-9 <= value <= high + 1e-9 for low, value, high in limits)
        count += len(some) if number < ALL else 0
    assert count / ALL >= min_branches


@pytest.mark.parametrize("name", ["panda", "iiwa7", "xarm7"])
def test_straight_paths_are_followed_without_jumps(name: str) -> None:
    chain, home = arm(name)
    solver, lost, steps = solver_of(chain, home), 0, 0
    for poses in list(straight_paths(chain, home))[:8]:
        q = home
        for pose in poses[::2]:
            after = solver.step_to(pose, q)
            steps += 1
            if after is None:
                lost += 1
                continue
            assert largest_step(after, q) <= MAX_STEP
            assert error(chain, after, pose) < 2e-6
            q = after
    assert (steps, lost <= 1) == (80, True)
