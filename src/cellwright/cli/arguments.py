"""What several commands take, as it is declared on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

WORK, END, OUTPUT, REACH = "What runs", "When it ends", "Output", "Where it is reached"
"""Headings in the help, under which options are listed."""

TRIAL = typer.Argument(
    metavar="TRIAL",
    help="A trial that comes with Cellwright, such as `lesson`, or a YAML file; several are joined, as by the "
    "original's launcher: `final01 kitter_sensors`.",
    show_default=False,
)

Files = Annotated[list[str], TRIAL]

Servo = Annotated[
    str | None,
    typer.Option(
        metavar="PROFILE",
        help="Servos of the arm: `original` (soft, as in 2017) or `precise`; as the file says when left out.",
        rich_help_panel=WORK,
    ),
]

Seed = Annotated[
    int | None,
    typer.Option(metavar="N", help="Root of all chance; the file's own, else 0.", rich_help_panel=WORK),
]

Vary = Annotated[
    bool,
    typer.Option(
        "--vary",
        metavar="",
        help="Move parts in bins, change friction and the phases of belt and gripper a little, by the seed.",
        rich_help_panel=WORK,
    ),
]

Development = Annotated[
    bool,
    typer.Option(
        "--development-mode",
        "-d",
        metavar="",
        help="Allow what a competition refuses, such as setting the belt's power.",
        rich_help_panel=WORK,
    ),
]

Until = Annotated[
    float | None, typer.Option(metavar="T", help="Stop at this simulation time [s].", rich_help_panel=END)
]

Record = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE.mcap",
        help="Record everything to this file, to be replayed and looked at; FILE.bag for the tools of ROS 1; "
        "repeatable.",
        rich_help_panel=OUTPUT,
    ),
]

Recorded = Annotated[
    Path,
    typer.Argument(metavar="FILE.mcap", help="What `--record` wrote, whole or cut short.", show_default=False),
]

Host = Annotated[str, typer.Option(metavar="HOST", help="Address to listen at.", rich_help_panel=REACH)]

Port = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Port to listen at; 0 takes a free one. 11399 when left out, or one of the next where it is in use.",
        rich_help_panel=REACH,
    ),
]

Log = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.jsonl",
        help="Write what happens to this file as it happens, with the evidence of each kit; a line of JSON each.",
        rich_help_panel=OUTPUT,
    ),
]
