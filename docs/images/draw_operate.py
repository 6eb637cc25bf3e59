"""Draws docs/images/operate-keyboard.svg and operate-signal.svg. To be run from the project's root.

The robot is the QingLong, in this process; the keys are those of an operator.
"""

import io
from pathlib import Path

from rich.console import Console

from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import Session
from cellwright.clients.operators.exercise import Wave, WaveShape, exercise
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.plots import tracking_svg
from cellwright.clients.operators.robot import JointLimits, OperatedRobot, ServiceCaller
from cellwright.clients.operators.terminal import panel
from cellwright.config.robot.robots import load_robot
from cellwright.robot.node import RobotNode

FOLDER = Path("docs/images")
RIGHT = "\x1b[C"

node = RobotNode(load_robot("qinglong", lambda _line: None))
session = Session(InProcess(node, node="/operator"))
robot = OperatedRobot(session)
limits = JointLimits.of(node.config.robot)

steps = [
    exercise(robot, "J_arm_r_04", Wave.lasting(shape, 0.3, 0.5, 4.0)) for shape in (WaveShape.SINE, WaveShape.STEP)
]
(FOLDER / "operate-signal.svg").write_text(tracking_svg(steps), encoding="utf-8")

keyboard = Keyboard(robot, Jog(robot, limits), ServiceCaller(lambda: session))
for keys in ("/", "arm_r_04", "\r", "+", RIGHT, RIGHT, "t", "c", "Z", "Z", "\x1b[A\x1b[B", RIGHT, RIGHT, RIGHT):
    keyboard.take(keys)
    session.sleep(0.1)
keyboard.take(RIGHT)
session.sleep(0.02)
console = Console(record=True, width=84, file=io.StringIO(), force_terminal=True)
console.print(panel(robot, keyboard.jog, limits, name=node.name, message=keyboard.message, height=26))
console.save_svg(str(FOLDER / "operate-keyboard.svg"), title="cellwright operate keyboard")
