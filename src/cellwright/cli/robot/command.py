"""`cellwright robot`: the joints of a robot with their indices, groups and limits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli import lines
from cellwright.cli.exit_status import DONE
from cellwright.cli.options import refuse
from cellwright.cli.robot import table as robot_table
from cellwright.cli.robot.init import write_skeleton
from cellwright.cli.robot.pose import read_pose
from cellwright.config.robot.document import document
from cellwright.config.robot.robots import load_robot


def robot(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="ROBOT",
            help="A robot that comes with Cellwright, a robot configuration (`vr_configs.yml`), a folder with one, or "
            "a URDF or xacro file.",
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", metavar="", help="Print joints, groups and the poses of all links as JSON.")
    ] = False,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="JSON",
            help="With --json: the posture for the poses of the links, such as "
            """`'{"elbow": 1.57}'`; joints that are left out stand at 0 [rad; m].""",
        ),
    ] = None,
    init: Annotated[
        Path | None,
        typer.Option(
            "--init",
            metavar="FILE.yml",
            help="Write the beginning of a robot configuration for a URDF: arms, grippers and head as names and joints "
            "suggest, to be gone through.",
        ),
    ] = None,
) -> None:
    """List the joints of a robot: index, type, links, limits, and the groups that a configuration puts them in.

    Indices are those that robot configuration files are written with: parents before children, children in the order
    of their elements in the URDF, fixed joints counted. The link that a joint moves has the joint's index, and the
    root link has -1. Without an argument, the robots that come along are listed.

        cellwright robot qinglong                  # one that comes along
        cellwright robot my_robot/vr_configs.yml   # where are the indices wrong?
        cellwright robot my_robot.urdf --json      # for programs
        cellwright robot my_robot.urdf --init vr_configs.yml

    With `--json`: `joints` in the order of their indices, and under `links` where the frame of each link is in the
    world, `[[x, y, z], [qx, qy, qz, qw]]`, with the root link at the origin. A limit that is null does not exist. Fixed
    joints have the limits 0 and -1 and no axis, as PyBullet reports them.

    Exit status: 0 done, 2 the file or the pose cannot be used.
    """
    if name is None:
        for option, value in (("--pose", pose), ("--init", init)):
            if value is not None:
                refuse(f"{option}: give a robot as well")
        robot_table.show_bundled(as_json=as_json)
        raise typer.Exit(DONE)
    if pose is not None and not as_json:
        refuse("--pose: the poses of links are printed with --json")
    if init is not None and (as_json or init.suffix.lower() not in (".yml", ".yaml")):
        refuse(f"--init {init}: give a file such as vr_configs.yml, and no --json")
    config = load_robot(name, lines.warn)
    if init is not None:
        write_skeleton(config, init)
    elif as_json:
        positions = read_pose(pose, config.robot) if pose is not None else {}
        typer.echo(json.dumps(document(config, positions), indent=2, allow_nan=False))
    else:
        robot_table.show(config)
    raise typer.Exit(DONE)
