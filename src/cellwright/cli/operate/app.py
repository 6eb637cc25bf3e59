"""The commands of `cellwright operate`."""

from __future__ import annotations

import typer

from cellwright.cli.operate.call import call
from cellwright.cli.operate.keyboard import keyboard
from cellwright.cli.operate.play import play
from cellwright.cli.operate.record import record
from cellwright.cli.operate.signal import signal

app = typer.Typer(
    name="operate",
    help="""Drive a robot's controller node without a headset.

    An operator is a client as any other: it comes over the node's socket or over ROS 1, and speaks on the io_teleop
    topics. Start the node first, in another terminal:

        cellwright teleop qinglong             # the robot
        cellwright operate keyboard            # move it by keys
        cellwright operate signal J_head_yaw   # does the joint follow as it should?
        cellwright operate record motion.csv   # write down what the robot does
        cellwright operate play motion.csv     # and have it do so again
        cellwright operate call home           # one word, for scripts""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)
app.command()(keyboard)
app.command()(signal)
app.command()(record)
app.command()(play)
app.command()(call)
