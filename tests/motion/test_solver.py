import math

import pytest

from cellwright.mechanism.qp_solver import QpSolver
from cellwright.motion.mounts import FixedMount, RailMount
from cellwright.motion.solver import Mount, Solver, largest_step, travel
from cellwright.motion.ur_solver import UrSolver, ur_form
from cellwright.util.pose import Pose
from tests.motion.arms import arm


def test_travel_counts_time_of_each_joint() -> None:
    assert travel((0.0, 0.0), (3.0, 8.0), (1.0, 2.0)) == 5.0
    assert travel((0.0, 0.0), (3.0, 8.0), (1.5, math.inf)) == math.hypot(2.0, 8.0)


def test_largest_step_is_that_of_one_joint() -> None:
    assert largest_step((0.0, 1.0, -1.0), (0.1, 0.5, -1.2)) == 0.5


def test_solvers_and_mounts_follow_the_protocols() -> None:
    chain, home = arm("ur5")
    form = ur_form(chain)
    assert form is not None
    solvers: list[Solver] = [UrSolver(chain, form, home), QpSolver(chain, home)]
    mounts: list[Mount] = [FixedMount(), RailMount(Pose(), (0.0, 1.0, 0.0), -1.0, 1.0, (0.4, 0.8))]
    # a program's loop, with each solver on each mount
    world_T_tool = chain.tool(home)
    for mount in mounts:
        position, world_T_base = next(mount.places(world_T_tool, 0.0))
        for solver in solvers:
            posture = next(solver.branches(world_T_base.inverse() @ world_T_tool, solver.home))
            assert position == 0.0
            assert posture == pytest.approx(home, abs=1e-5)
