"""`cellwright operate keyboard`: a robot driven by the keys of a terminal."""

from __future__ import annotations

import sys
from contextlib import closing

import typer
from rich.console import Console
from rich.live import Live

from cellwright.cli import options
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.operate.link import NODE, Connect, Link, Node, OverRos1, Robot
from cellwright.clients.operators.jog import Jog
from cellwright.clients.operators.keyboard import Keyboard
from cellwright.clients.operators.panel import panel
from cellwright.clients.operators.services import Services
from cellwright.clients.operators.terminal import TerminatedError
from cellwright.clients.operators.terminal import keyboard as terminal_keyboard
from cellwright.util.errors import RunEndedError


def keyboard(connect: Connect = None, ros1: OverRos1 = False, robot: Robot = None, node: Node = NODE) -> None:
    """Drive a robot by the keys of this terminal: joints, tips, grippers, home, enable, emergency stop.

    A key is one step, from where the robot stands; when it is let go nothing is sent any more, and the robot holds. The
    keys are listed on the screen. Joints are moved by /io_teleop/joint_cmd, tips by /io_teleop/target_ee_poses, and
    grippers by /io_teleop/target_gripper_status. The space bar sends /io_teleop/emergency_stop, also while the robot
    goes home; that is software, and replaces no hardware circuit.

        cellwright operate keyboard

        # a robot of your own, with its limits on the screen
        cellwright operate keyboard --robot my_robot/vr_configs.yml

    Exit status: 0 quit with q or Ctrl-C; 1 the node has ended, or the process was asked to; 2 bad input, or no
    terminal.
    """
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        options.refuse(
            "the keyboard operator needs a terminal; without one: cellwright operate play FILE, "
            "or cellwright operate signal JOINT"
        )
    link = Link(connect, ros1=ros1, node=node, robot=robot)
    console = Console(highlight=False)
    ended = ""
    with link.robot() as there, closing(Services(lambda: link.session("_services"))) as services:
        limits = link.limits(there)
        operator = Keyboard(there, Jog(there, limits), services)
        name = link.name(there)
        live = Live(console=console, screen=True, auto_refresh=False)

        def draw() -> None:
            shown = panel(there, operator.jog, limits, name=name, message=operator.message, height=console.size.height)
            live.update(shown, refresh=True)

        try:
            with terminal_keyboard() as read, live:
                operator.run(read, draw)
        except KeyboardInterrupt:
            pass
        except (RunEndedError, TerminatedError) as error:
            ended = str(error)
    if ended:
        typer.echo(f"error: {ended}", err=True)
    console.print(f"{there.sent} messages sent; the robot stays where it was told to go", markup=False)
    raise typer.Exit(NOT_DONE if ended else DONE)
