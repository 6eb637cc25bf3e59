"""What `cellwright teleop` takes, as it is declared on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.arguments import OUTPUT, REACH, WORK
from cellwright.robot.safety.settings import Guard
from cellwright.robot.servos import Motion

SAFETY = "Safety"
"""Heading in the help, under which options are listed."""

Robot = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A robot that comes with Cellwright, such as `qinglong`; a robot configuration (`vr_configs.yml`) or its "
        "folder; or a URDF.",
        show_default=False,
    ),
]
MotionLaw = Annotated[
    Motion,
    typer.Option(
        metavar="LAW",
        help="`servo`: with the URDF's speeds and efforts; `teleport`: at once.",
        rich_help_panel=WORK,
    ),
]
Rate = Annotated[str, typer.Option(metavar="HZ", help="Steps of physics a second.", rich_help_panel=WORK)]
Check = Annotated[
    bool,
    typer.Option(
        "--check",
        metavar="",
        help="Only look how the robot moves: against its recorded motion, or else joint by joint.",
        rich_help_panel=WORK,
    ),
]
SelfCollision = Annotated[
    bool, typer.Option("--self-collision", metavar="", help="Let links touch each other.", rich_help_panel=WORK)
]
SimTime = Annotated[
    bool,
    typer.Option(
        "--sim-time",
        metavar="",
        help="Tell simulation time on /clock, and stamp messages with it.",
        rich_help_panel=WORK,
    ),
]
Speed = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR",
        help="Simulated seconds a second, or `max`; other than 1 only with --sim-time.",
        rich_help_panel=WORK,
    ),
]
Lockstep = Annotated[
    bool,
    typer.Option(
        "--lockstep",
        metavar="",
        help="Let time pass only when a guest asks; implies --sim-time.",
        rich_help_panel=WORK,
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        metavar="",
        help="Print the summary as JSON at the end, and nothing else on stdout.",
        rich_help_panel=OUTPUT,
    ),
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", metavar="", help="Say more in the summary.", rich_help_panel=OUTPUT)
]

OwnDriver = Annotated[
    str | None,
    typer.Option(
        "--driver",
        metavar="FILE.py:CLASS",
        help="Have a robot of your own moved, by a driver of your own; nothing is simulated then.",
        rich_help_panel=WORK,
    ),
]
CheckDriver = Annotated[
    bool,
    typer.Option(
        "--check-driver",
        metavar="",
        help="Move each joint of that robot by 0.02 and back, say what is wrong with its driver, and stop.",
        rich_help_panel=WORK,
    ),
]
Gui = Annotated[
    bool, typer.Option("--gui", metavar="", help="Show the robot in a window, MuJoCo's own.", rich_help_panel=OUTPUT)
]
InitDebug = Annotated[
    bool,
    typer.Option(
        "--init-debug",
        metavar="",
        help="Show it with a slider for each joint, under `Control`.",
        rich_help_panel=OUTPUT,
    ),
]
Snapshot = Annotated[
    Path | None,
    typer.Option(metavar="FILE.png", help="Write a picture of the robot at the end.", rich_help_panel=OUTPUT),
]

StartDisabled = Annotated[
    bool,
    typer.Option(
        "--start-disabled",
        metavar="",
        help="Take no commands until the service /io_teleop/set_enabled says so.",
        rich_help_panel=SAFETY,
    ),
]
Watchdog = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Hold the joints that a topic moves when nothing has come on it for so long [s], such as 0.5.",
        rich_help_panel=SAFETY,
    ),
]
MaxSpeed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="[JOINTS=]V",
        help="Move targets no faster than this [rad/s; m/s]; for joints whose names fit a pattern: `J_arm_*=1.5`. May "
        "be repeated, the last that fits counts.",
        rich_help_panel=SAFETY,
    ),
]
StartGuard = Annotated[
    float | None,
    typer.Option(
        metavar="D",
        help="How far a first target may be from where the joint stands [rad; m], such as 0.8.",
        rich_help_panel=SAFETY,
    ),
]
GuardThen = Annotated[
    Guard,
    typer.Option(
        "--start-guard-then",
        metavar="WHAT",
        help="What becomes of one farther away: `refuse`, or `blend` (go there slowly).",
        rich_help_panel=SAFETY,
    ),
]
ResumeSpeed = Annotated[
    float,
    typer.Option(
        metavar="V",
        help="Speed of the first approach after a stop, a silence or a blend [rad/s; m/s].",
        rich_help_panel=SAFETY,
    ),
]
OneCommander = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Take a topic from one node only, until it has been silent for so long [s].",
        rich_help_panel=SAFETY,
    ),
]
MaxAge = Annotated[
    float | None,
    typer.Option(
        metavar="S",
        help="Refuse commands stamped longer ago [s], or earlier than the one before.",
        rich_help_panel=SAFETY,
    ),
]
Clutch = Annotated[
    bool,
    typer.Option(
        "--clutch",
        metavar="",
        help="Let targets count from where they and the joints were at first.",
        rich_help_panel=SAFETY,
    ),
]
TipSpeed = Annotated[
    float | None,
    typer.Option(
        metavar="V",
        help="How fast the tips of arms are brought to poses [m/s]; 2 when left out.",
        rich_help_panel=SAFETY,
    ),
]
TipTurning = Annotated[
    float | None,
    typer.Option(
        metavar="W",
        help="How fast they are turned on the way [rad/s]; a turn a second when left out.",
        rich_help_panel=SAFETY,
    ),
]
InRos1 = Annotated[
    bool,
    typer.Option(
        "--ros1",
        metavar="",
        help="Be a node of ROS 1 too, at the master that ROS_MASTER_URI names.",
        rich_help_panel=REACH,
    ),
]
NodeName = Annotated[
    str,
    typer.Option("--node", metavar="NAME", help="Name of the node in ROS.", rich_help_panel=REACH),
]
