"""The solver of an arm by its chain: closed form where there is one, else quadratic programs."""

from collections.abc import Sequence

from cellwright.mechanism.qp_solver import QpSolver
from cellwright.motion.chain import Chain
from cellwright.motion.solver import Solver
from cellwright.motion.ur_solver import UrSolver, ur_form


def solver_of(chain: Chain, home: Sequence[float]) -> Solver:
    """Return the solver of an arm.

    Args:
        chain: the arm, without a rail: that is its mount.
        home: home posture [rad; m]; `home_fault` says whether it is a good one.

    Example:
        >>> from cellwright.motion.chain import ChainJoint
        >>> from cellwright.util.pose import Pose
        >>> slide = ChainJoint("slide", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), is_prismatic=True, lower=0.0, upper=2.0)
        >>> solver = solver_of(Chain((slide,), Pose()), (0.5,))
        >>> [round(each, 6) for each, in solver.branches(Pose((1.5, 0.0, 0.0)), solver.home)]
        [1.5]
    """
    form = ur_form(chain)
    return QpSolver(chain, home) if form is None else UrSolver(chain, form, home)
