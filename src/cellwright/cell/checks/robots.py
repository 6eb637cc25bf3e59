"""Check of the robots in a cell: that the engine can build them, and that they begin a run apart from what is fixed."""

import mujoco

from cellwright.cell.model.build import build_world
from cellwright.config.parsing.findings import Finding
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import CellwrightError

DEPTH = 0.005
"""Depth [m] to which a robot may begin a run within something fixed: its shapes are simpler than it is."""


def robot_problems(trial: Trial) -> list[Finding]:
    """Return what is wrong with the robots of a trial beyond their descriptions.

    Example:
        >>> import cellwright
        >>> robot_problems(cellwright.load_trial("lesson"))
        []
    """
    if not trial.layout.robots:
        return []
    try:
        world = build_world(trial)
    except CellwrightError as error:
        return [Finding("cell.robots", " ".join(str(error).split()))]
    model, data = world.model, mujoco.MjData(world.model)
    world.set_initial_posture(data)
    mujoco.mj_fwdPosition(model, data)
    deepest: dict[tuple[str, str], float] = {}
    for contact in data.contact[: data.ncon]:
        bodies = (int(model.geom_bodyid[geom]) for geom in contact.geom)
        one, other = sorted(bodies, key=lambda body: int(model.body_weldid[body]) == 0)
        if contact.dist < -DEPTH and int(model.body_weldid[other]) == 0:
            pair = (model.body(one).name, model.body(other).name)
            deepest[pair] = max(-contact.dist, deepest.get(pair, 0.0))
    return [
        Finding(
            f"cell.robots.{robot.name}",
            f"{link.removeprefix(robot.prefix)} begins {depth:.3f} m within "
            f"{'the floor' if other == 'world' else other}; move the robot, or raise it: at",
        )
        for robot in trial.layout.robots
        for (link, other), depth in deepest.items()
        if link.startswith(robot.prefix)
    ]
