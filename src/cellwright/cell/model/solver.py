"""Settings of the engine's solver, and why they are as they are."""

from __future__ import annotations

from typing import Any

import mujoco


def contact_time(timestep: float) -> float:
    """Time constant [s] of contacts: as stiff as the step allows.

    With the engine's default of 20 ms a part sinks 0.1 mm into what it lies on, and an arm pressed onto a part by its
    servos sinks in by millimetres.
    """
    return max(0.004, 2 * timestep)


def set_solver(spec: Any, timestep: float, friction: float = 1.0) -> None:
    """Set integrator, solver and contact defaults of a model specification.

    Args:
        spec: an `MjSpec`.
        timestep: length of a step [s].
        friction: coefficient of dry friction of everything that says nothing else.
    """
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0  # parts on a tray or in a bin do not creep
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = 20
    option.ls_iterations = 50  # with 20 a kit of many contacts creeps on an AGV that speeds up
    option.tolerance = 1e-8
    option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # a part at rest costs next to nothing
    option.sleep_tolerance = 1e-3
    # islands (sleep is by island) and several contacts for a pair of convex shapes (else parts rock)
    option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_MULTICCD)
    geom = spec.default.geom
    geom.solref = (contact_time(timestep), 1.0)
    geom.friction = (friction, 0.005, 0.0001)
    geom.condim = 3
