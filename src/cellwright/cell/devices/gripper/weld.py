"""Welds: what the engine holds together where a cup sucks or a tray locks."""

from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose


def engage(simulation: Simulation, weld: int, body: int, body_T_other: Pose) -> None:
    """Have a weld keep the other of its two bodies at a pose in the frame of `body`, from the next step on.

    The engine keeps the pose of the weld's second body in the frame of its first (`eq_data` 3:6 and 6:10), and the
    point that it anchors at in the second body's frame (0:3).
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
