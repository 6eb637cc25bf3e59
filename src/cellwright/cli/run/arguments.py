"""What `cellwright run` takes, as it is declared on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.arguments import END, OUTPUT, WORK
from cellwright.cli.run.pictures import Quality
from cellwright.cli.view.arguments import LOOK

SAVE, PROCESSES = "Checkpoints", "Agent and cell in two processes"
"""Headings in the help, under which options are listed."""

AgentName = Annotated[
    str,
    typer.Option(
        metavar="AGENT",
        help="What works the cell: `kitter`, `lesson`, your `path.py:Class` or `module:Class`, or `none`.",
        rich_help_panel=WORK,
    ),
]
Speed = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR",
        help="Simulated seconds a second: `1` is real time, `max` as fast as it goes. `max` when left out, but "
        "`1` with --view, and with --over and no --lockstep.",
        rich_help_panel=WORK,
    ),
]
Over = Annotated[
    str | None,
    typer.Option(
        metavar="WAY",
        help="Run the agent in a process of its own, which comes to the cell over a `socket` or over `ros1`.",
        rich_help_panel=PROCESSES,
    ),
]
Lockstep = Annotated[
    bool,
    typer.Option(
        "--lockstep",
        metavar="",
        help="With --over: let time pass only while the agent waits; the same result as in one process.",
        rich_help_panel=PROCESSES,
    ),
]
Connect = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT",
        help="Work the cell that `cellwright serve` has there, instead of one of TRIAL.",
        rich_help_panel=PROCESSES,
    ),
]
MinScore = Annotated[
    float | None,
    typer.Option(metavar="POINTS", help="Exit with status 1 when the score is below.", rich_help_panel=END),
]
Snapshots = Annotated[
    list[str] | None,
    typer.Option(
        metavar="T:FILE.png", help="Take a picture at a simulation time [s]; repeatable.", rich_help_panel=LOOK
    ),
]
View = Annotated[
    bool,
    typer.Option(
        "--view",
        metavar="",
        help="Show it on a page, in a browser; the page's address is printed. The page stays after the run, until "
        "Ctrl-C; with --json it ends with the run.",
        rich_help_panel=LOOK,
    ),
]
WithPicture = Annotated[
    bool,
    typer.Option("--picture/--no-picture", metavar="", help="Write TRIAL.png at the end.", rich_help_panel=LOOK),
]
TakenFrom = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Where pictures are taken from: overview, bins, belt, agv1, agv2, or `x,y,z:x,y,z` [m].",
        rich_help_panel=LOOK,
    ),
]
HowDrawn = Annotated[
    Quality,
    typer.Option(
        metavar="HOW",
        help="How pictures are drawn: `fine`, by rays, or `fast`, by OpenGL as videos are.",
        rich_help_panel=LOOK,
    ),
]
Checkpoints = Annotated[
    list[str] | None,
    typer.Option(
        metavar="T:FILE.npz",
        help="Save the simulation at this time [s]; repeatable. It is an event of the run: the state hash changes.",
        rich_help_panel=SAVE,
    ),
]
Resume = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.npz", help="Begin from what --checkpoint saved; the agent begins anew.", rich_help_panel=SAVE
    ),
]
Listen = Annotated[
    list[str] | None,
    typer.Option(
        metavar="TOPIC", help="Count a topic's messages, `all` for every topic; repeatable.", rich_help_panel=LOOK
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        metavar="",
        help="Print the result as JSON, and nothing else on stdout.",
        rich_help_panel=OUTPUT,
    ),
]
TeamAverages = Annotated[
    str | None,
    typer.Option(
        metavar="COST,TIME",
        help="Score the trial as in the finals, against these averages of all teams [$, s]; a time for each order.",
        rich_help_panel=OUTPUT,
    ),
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", metavar="", help="Say what the agent logs.", rich_help_panel=OUTPUT)
]
