"""A robot as people read it: a row for each joint, and what the configuration makes of them."""

from __future__ import annotations

import json
import math
import sys

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.config_keys import UNUSED
from cellwright.config.robot.document import groups_of, parent_index
from cellwright.config.robot.model import Joint, JointType
from cellwright.config.robot.robots import bundled, find_robot, load_robot

_WIDEST = 1000  # of a table that goes into a file or through a pipe: nothing is folded there


def show(config: RobotConfig) -> None:
    """Print a robot's table, and below it what belongs to no single joint."""
    console = _console()
    robot = config.robot
    counts = f"{len(robot.joints)} joints, {len(robot.driven)} of them driven"
    console.print(f"{config.name}: {counts}; root link {robot.root} (-1)", markup=False, soft_wrap=True)
    console.print()
    whole = table(config)
    needed = console.measure(whole, options=console.options.update(width=_WIDEST)).maximum
    is_narrow = needed > console.width
    _print(console, table(config, is_narrow=True) if is_narrow else whole)
    console.print()
    notes = _notes(config)
    if is_narrow:
        notes.insert(1, ("left out", f"effort and speed, for which a terminal needs {needed} columns, or `| cat`"))
    for name, text in notes:
        console.print(f"{name:<10}  {text}", markup=False, soft_wrap=True)


def table(config: RobotConfig, *, is_narrow: bool = False) -> Table:
    """A row for each joint, in the order of their indices.

    Args:
        config: the robot.
        is_narrow: whether to leave out what one asks for least, so that names stay in one piece.
    """
    found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), collapse_padding=True)
    found.add_column("#", justify="right", no_wrap=True)
    found.add_column("joint", overflow="fold")
    found.add_column("type", no_wrap=True)
    found.add_column("link", overflow="fold")
    found.add_column("on", justify="right", no_wrap=True)
    for heading in ("lower", "upper") if is_narrow else ("lower", "upper", "effort", "speed"):
        found.add_column(heading, justify="right", no_wrap=True)
    found.add_column("group", overflow="fold")
    found.add_column("home", justify="right", no_wrap=True)
    for index, joint in enumerate(config.robot.joints):
        found.add_row(*_cells(config, index, joint, is_narrow=is_narrow))
    return found


def show_bundled(*, as_json: bool) -> None:
    """Print the robots that come along."""
    found = {name: load_robot(name, lambda _line: None) for name in bundled()}
    if as_json:
        entries = [
            {
                "name": name,
                "robot_name": config.name,
                "file": str(find_robot(name)),
                "joints": len(config.robot.joints),
                "movable": len(config.robot.movable),
                "arms": len(config.arms),
                "grippers": len(config.grippers),
            }
            for name, config in found.items()
        ]
        typer.echo(json.dumps({"robots": entries}, indent=2))
        return
    rows = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    rows.add_column("robot", no_wrap=True)
    for heading in ("joints", "driven", "arms", "grippers"):
        rows.add_column(heading, justify="right")
    for name, config in found.items():
        counts = (len(config.robot.joints), len(config.robot.driven), len(config.arms), len(config.grippers))
        rows.add_row(Text(name), *map(str, counts))
    _print(_console(), rows)


def _cells(config: RobotConfig, index: int, joint: Joint, *, is_narrow: bool) -> list[str | Text]:
    on = str(parent_index(config, joint))
    group = ", ".join(_label(config, key) for key in groups_of(config, joint))
    if joint.mimic is not None:
        group = f"{group}, mimic" if group else "mimic"
    home = config.home.get(joint.name)
    limits = joint.limits
    is_fixed = joint.type is JointType.FIXED
    numbers = (
        [limits.lower, limits.upper] if is_narrow else [limits.lower, limits.upper, limits.effort, limits.velocity]
    )
    figures = ["" if is_fixed else _figure(number) for number in numbers]
    return [
        str(index),
        Text(joint.name),
        str(joint.type),
        Text(joint.child),
        on,
        *figures,
        group,
        "" if home is None else _figure(home),
    ]


def _label(config: RobotConfig, key: str) -> str:
    """What a group is called in a narrow column: R and L (right, left) where there are two."""
    name, _, number = key.rstrip("]").partition("[")
    if not number:
        return {"dorsal": "lift"}.get(name, name)
    count = len(config.arms if name == "arms" else config.grippers)
    one = name.removesuffix("s")
    return one if count == 1 else f"{one} {'RL'[int(number)] if count == 2 else number}"


def _notes(config: RobotConfig) -> list[tuple[str, str]]:
    notes = [("units", "rad and m, N m and N, rad/s and m/s; on: index of the link that the joint sits on")]
    for number, arm in enumerate(config.arms):
        reference = config.reference_links[number] or "the base"
        command = config.command_links[number]
        by = f"; poses move {command}" if command != arm.tip else "; poses"
        notes.append((_label(config, f"arms[{number}]"), f"tip {arm.tip}{by} in the frame of {reference}"))
    for number, gripper in enumerate(config.grippers):
        ends = dict.fromkeys(gripper.open_ends)
        if ends:
            text = f"{next(iter(ends))} limits" if len(ends) == 1 else f"limits: {', '.join(gripper.open_ends)}"
            notes.append((_label(config, f"grippers[{number}]"), f"open at the {text} of its joints"))
    if config.max_accelerations:
        bounds = ", ".join(f"{name} {value:g}" for name, value in config.max_accelerations.items())
        notes.append(("bounds", f"of accelerations, rad/s² and m/s²: {bounds}"))
    if config.fixed_link is not None:
        notes.append(("fixed", f"{config.fixed_link} is fastened to the world instead of the root"))
    for joint in config.robot.joints:
        if joint.mimic is not None:
            offset = f" + {joint.mimic.offset:g}" if joint.mimic.offset else ""
            notes.append(("mimic", f"{joint.name} = {joint.mimic.multiplier:g} * {joint.mimic.joint}{offset}"))
    unused = [f"{key} ({UNUSED[key]})" for key in config.others if key in UNUSED]
    notes += [("camera", camera.name) for camera in config.cameras]
    notes += [("not used", text) for text in unused]
    notes.append(("urdf", str(config.urdf_path)))
    return notes


def _console() -> Console:
    return Console(highlight=False, width=None if sys.stdout.isatty() else _WIDEST)


def _print(console: Console, found: Table) -> None:
    """Print a table without the blanks that fill up its lines."""
    with console.capture() as capture:
        console.print(found)
    for line in capture.get().splitlines():
        console.file.write(f"{line.rstrip()}\n")


def _figure(number: float) -> str:
    """A number in few characters; a dash where there is no limit."""
    return f"{round(number, 3) + 0.0:.4g}" if math.isfinite(number) else "-"
