"""Command group `cellwright operate`."""

import typer

from cellwright.cli.operate.call import call
from cellwright.cli.operate.cell import cell
from cellwright.cli.operate.keyboard import keyboard
from cellwright.cli.operate.play import play
from cellwright.cli.operate.record import record
from cellwright.cli.operate.signal import signal

app = typer.Typer(
    name="operate",
    help="""Drive a robot's controller node without a headset.

    An operator is a client like any other: it connects over the node's socket, over ROS 1 or over ROS 2, and uses the
    io_teleop topics. Start the node first, in another terminal:

        cellwright teleop qinglong             # the robot
        cellwright operate keyboard            # move it with keys
        cellwright operate signal J_head_yaw   # measure how well a joint follows
        cellwright operate record motion.csv   # record the robot's motion
        cellwright operate play motion.csv     # play it
        cellwright operate call home           # one command, for scripts
        cellwright operate cell                # the arms of a cell, through its agent operator""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)
for command in (keyboard, signal, record, play, call, cell):
    app.command()(command)
