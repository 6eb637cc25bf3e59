"""Welds that hold parts: one for each holder and part in the model, engaged at run time."""

from math import hypot
from typing import Any

import mujoco

from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose

_HOLD = (0.95, 0.99, 0.001, 0.5, 2.0)  # solimp of a weld that holds a part


def grip_name(part: str, gripper: str = "") -> str:
    """Return the name of the weld between a gripper and the body of a part.

    Args:
        part: name of the part's body.
        gripper: name of the gripper; empty for the only one of a cell.

    Example:
        >>> grip_name("bin7|gear_part_1"), grip_name("bin7|gear_part_1", "arm1")
        ('grip|bin7|gear_part_1', 'grip|arm1|bin7|gear_part_1')
    """
    return "|".join(("grip", gripper, part) if gripper else ("grip", part))


def add_weld(spec: Any, name: str, holder: str, part: str, time: float) -> None:
    """Add an inactive weld between two bodies to a model specification.

    Args:
        spec: model specification.
        name: name of the weld, `grip_name` for that of a gripper.
        holder: name of the body that can hold the part.
        part: name of the part's body.
        time: time constant [s] of the weld.
    """
    weld = spec.add_equality(
        name=name, type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=holder, name2=part
    )
    weld.active = False
    weld.solref = (time, 1.0)
    weld.solimp = _HOLD
    # anchor, pose (written when the weld engages), torque scale
    weld.data = (0,) * 6 + (1, 0, 0, 0, 1, 0)


def find_weld(model: mujoco.MjModel, name: str) -> int | None:
    """Return the id of a weld by its name; None if the model has none."""
    found = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_EQUALITY, name))
    return found if found >= 0 else None


def engage_weld(simulation: Simulation, weld: int, body: int, body_T_other: Pose) -> None:
    """Engage a weld: from the next step on it keeps the other of its two bodies at a pose in the frame of `body`.

    The engine's `eq_data` holds the pose of the weld's second body in the frame of its first (3:6 and 6:10). At 0:3 it
    holds the anchor point in the second body's frame.
    """
    model, data = simulation.model, simulation.data
    is_first = int(model.eq_obj1id[weld]) == body
    relative = body_T_other if is_first else body_T_other.inverse()
    model.eq_data[weld, 0:3] = 0.0
    model.eq_data[weld, 3:6] = relative.position
    model.eq_data[weld, 6:10] = relative.quaternion
    data.eq_active[weld] = 1
    for each in (int(model.eq_obj1id[weld]), int(model.eq_obj2id[weld])):
        simulation.wake(each)


def weld_force(data: mujoco.MjData, weld: int) -> float:
    """Return the force [N] that a weld transmitted in the last step, without its torque; 0 if it was not engaged."""
    # equality constraints come first; the first three of a weld's six rows are along the axes of the world
    ids = data.efc_id[: data.ne].tolist()
    if weld not in ids:
        return 0.0
    row = ids.index(weld)
    return hypot(*data.efc_force[row : row + 3].tolist())
