"""Draws the pictures of the bundled robots: python docs/images/draw_robots.py."""

import math
from pathlib import Path

import mujoco

from cellwright.config.robot.robots import load_robot
from cellwright.robot.model import build_robot
from cellwright.robot.pictures import save_robot_picture

HERE = Path(__file__).parent


def draw(name: str, width: int, height: int, turn: float, extra: dict[str, float]) -> None:
    """Draw a robot at home, but for some joints [rad; m]."""
    config = load_robot(name, lambda _line: None)
    world = build_robot(config)
    data = mujoco.MjData(world.model)
    for joint, position in {**config.home, **extra}.items():
        data.qpos[world.model.joint(joint).qposadr[0]] = position
        for other in config.robot.driven:
            if other.mimic is not None and other.mimic.joint == joint:
                data.qpos[world.model.joint(other.name).qposadr[0]] = position
    save_robot_picture(HERE / f"{name}.png", world, data, (width, height), turn=math.radians(turn), samples=4)


FIST = {f"rh_{finger}J{number}": 1.5 for finger in ("FF", "MF", "RF", "LF") for number in (1, 2, 3)}

draw("qinglong", 640, 800, -28, {**FIST, "J_head_yaw": -0.3, "J_head_pitch": -0.05})
draw("tandem", 640, 800, -28, {"right_gripper": 0.02})
