"""Check of the robots in a cell: that the engine can build them, and that they begin a run in nothing but parts."""

import mujoco

from cellwright.cell.model.build import build_world
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.config.parsing.findings import Finding
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import CellwrightError

DEPTH = 0.005
"""Depth [m] to which a robot may begin a run within something else: its shapes are simpler than it is."""


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
    parts = {part.body for part in (*world.parts, *world.bodies)}
    robots = trial.layout.robots
    owners = {
        int(model.body(robot.prefix + link).id): number
        for number, robot in enumerate(robots)
        for link in trial.robot_models[robot.name].robot.links
    }
    deepest: dict[tuple[int, int], float] = {}
    for contact in data.contact[: data.ncon]:
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        # of two robots, the later one is to move
        other, link = sorted(bodies, key=lambda body: owners.get(body, -1))
        if contact.dist < -DEPTH and link in owners and other not in parts:
            deepest[link, other] = max(-contact.dist, deepest.get((link, other), 0.0))
    frames = frames_by_link(trial)
    found = []
    for (link, other), depth in deepest.items():
        robot, name = robots[owners[link]], model.body(other).name
        place = "the floor" if name == "world" else frames.get(name, name)
        begins = f"{model.body(link).name.removeprefix(robot.prefix)} begins {depth:.3f} m within {place}"
        found.append(Finding(f"cell.robots.{robot.name}", f"{begins}; move the robot, or raise it: at"))
    return found
