"""Command `cellwright operate keyboard`: driving a robot with the keys of a terminal."""

import sys
from contextlib import closing

import typer
from rich.console import Console
from rich.live import Live

from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.connection import NODE, AddressArguments, Node, NodeConnection, Robot
from cellwright.cli.output import echo, print_line
from cellwright.cli.parameters import with_groups
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.robot import ServiceCaller
from cellwright.clients.operators.terminal import TerminatedError, panel
from cellwright.clients.operators.terminal import keyboard as terminal_keyboard
from cellwright.util.errors import RunEndedError


@with_groups
def keyboard(address: AddressArguments, robot: Robot = None, node: Node = NODE) -> None:
    """Drive a robot with the keys of this terminal: joints, tips, grippers, home, enable, emergency stop.

    Each key press is one step from the robot's present position; on release nothing is sent, and the robot holds. The
    screen lists the keys. Joints move by /io_teleop/joint_cmd, tips by /io_teleop/target_ee_poses, and grippers by
    /io_teleop/target_gripper_status. The space bar sends /io_teleop/emergency_stop, also while the robot goes home;
    this is a software stop and replaces no hardware circuit.

        cellwright operate keyboard

        # your own robot, with its limits on the screen
        cellwright operate keyboard --robot my_robot/vr_configs.yml

    Exit status: 0 quit with q or Ctrl-C; 1 the node has ended, or a signal ended the process; 2 bad input, or no
    terminal.
    """
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        options.refuse(
            "the keyboard operator requires a terminal; without one use cellwright operate play FILE "
            "or cellwright operate signal JOINT"
        )
    link = NodeConnection(address, node, robot)
    console = Console(highlight=False)
    ended = ""
    with link.robot() as operated, closing(ServiceCaller(lambda: link.session("_services"))) as services:
        limits = link.limits(operated)
        operator = Keyboard(operated, Jog(operated, limits), services)
        name = link.name(operated)
        live = Live(console=console, screen=True, auto_refresh=False)

        def draw() -> None:
            shown = panel(
                operated, operator.jog, limits, name=name, message=operator.message, height=console.size.height
            )
            live.update(shown, refresh=True)

        try:
            with terminal_keyboard() as read, live:
                operator.run(read, draw)
        except KeyboardInterrupt:
            pass
        except (RunEndedError, TerminatedError) as error:
            ended = str(error)
    if ended:
        echo(f"error: {ended}", err=True)
    print_line(console, f"{operated.sent} messages sent; the robot holds its last targets")
    raise typer.Exit(NOT_DONE if ended else DONE)
