"""Command `cellwright robot`: the joints of a robot as a table or as JSON, and the start of a configuration."""

import json
import math
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from cellwright.cli import options, output
from cellwright.cli.arguments import ROBOT_HELP, XacroArguments
from cellwright.cli.main import DONE
from cellwright.cli.options import refuse
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.config.robot.config import UNUSED, RobotConfig
from cellwright.config.robot.groups import groups_of, parent_index, robot_document
from cellwright.config.robot.model import Joint, JointType, RobotModel
from cellwright.config.robot.robots import bundled, find_robot, load_robot, read_robot_config
from cellwright.config.robot.skeleton import skeleton
from cellwright.util.errors import UnknownNameError

_EXAMPLE = """give positions by joint, such as '{"elbow": 1.57}'"""
_MAX_POSITION = 1e6  # [rad; m]; a position beyond is a mistake, and rounding makes such turns meaningless
_MAX_WIDTH = 1000  # width of a table in a file or through a pipe: nothing is folded there


def read_pose(text: str, robot: RobotModel) -> dict[str, float]:
    """Read the positions of joints by name [rad; m]."""
    try:
        positions = json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = f"{error.msg}, at character {error.pos + 1}" if isinstance(error, json.JSONDecodeError) else "no JSON"
        refuse(f"--pose: invalid JSON ({reason}); {_EXAMPLE}")
    if not isinstance(positions, dict):
        refuse(f"--pose: must be a JSON object; {_EXAMPLE}")
    return {name: _position(name, value, robot) for name, value in positions.items()}


def _position(name: str, value: Any, robot: RobotModel) -> float:
    driven = [joint.name for joint in robot.driven]
    if name not in driven:
        if name in robot.joint_indices:
            refuse(f"--pose: {name} is {robot.joint(name).type}, and has no position (known: {', '.join(driven)})")
        refuse(f"--pose: {UnknownNameError('joint', name, driven).sentence()}")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or abs(value) > _MAX_POSITION:
        refuse(f"--pose: {name}: must be a finite number [rad; m] (got {json.dumps(value)[:40]})")
    return float(value)


def write_skeleton(config: RobotConfig, file: Path) -> None:
    """Write the first draft of a robot's configuration, and print its content."""
    text = skeleton(config.robot, config.urdf_path.resolve(), file.parent.resolve(), config.xacro_arguments)
    _write_new("--init", file, text)
    draft = read_robot_config(file, lambda _line: None)
    groups = {"arm": len(draft.arms), "gripper": len(draft.grippers), "head": int(draft.head is not None)}
    groups |= {"waist": int(draft.waist is not None), "lift": int(draft.dorsal is not None)}
    listed = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for name, count in groups.items() if count)
    typer.echo(
        f"{file}: {listed or 'no groups found'}, all guessed; review the file, then run: cellwright check {file}"
    )


def _write_new(option: str, file: Path, text: str) -> None:
    """Write a file that does not exist yet, in a folder that does."""
    if not file.parent.is_dir():
        refuse(f"{option} {file}: there is no folder {file.parent}")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        refuse(f"{option} {file}: file exists; choose another name, or remove it")
    except OSError as error:
        with suppress(OSError):
            file.unlink()  # it may be half written
        refuse(f"{option} {file}: cannot be written: {error.strerror}")


def show_robot(config: RobotConfig) -> None:
    """Print a robot's table, and below it the facts of no single joint."""
    console = _console()
    robot = config.robot
    output.print_line(console, f"{config.name}: {joint_counts(robot)}; root link {robot.root} (-1)")
    console.print()
    whole = joint_table(config)
    needed = console.measure(whole, options=console.options.update(width=_MAX_WIDTH)).maximum
    is_narrow = needed > console.width
    print_table(console, joint_table(config, is_narrow=True) if is_narrow else whole)
    console.print()
    notes = _notes(config)
    if is_narrow:
        notes.insert(1, ("left out", f"effort and speed; they need a terminal of {needed} columns, or `| cat`"))
    for name, text in notes:
        output.print_entry(console, name, text)


def commanded_count(robot: RobotModel) -> int:
    """Return the number of joints that a program commands: those that are driven and follow no other."""
    return sum(joint.mimic is None for joint in robot.driven)


def joint_counts(robot: RobotModel) -> str:
    """Return the number of joints of a robot by kind, in words."""
    commanded = commanded_count(robot)
    fixed = len(robot.joints) - len(robot.movable)
    other = len(robot.movable) - len(robot.driven)
    kinds = {"commanded": commanded, "mimic": len(robot.driven) - commanded, "fixed": fixed, "not driven": other}
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
    return f"{len(robot.joints)} joints{listed and f': {listed}'}"


def joint_table(config: RobotConfig, *, is_narrow: bool = False) -> FittedTable:
    """Return a table with a row for each joint, in the order of indices; a narrow table leaves out effort and speed."""
    columns = {"#": RIGHT, "joint": FOLD, "type": WHOLE, "link": FOLD, "on": RIGHT, "lower": RIGHT, "upper": RIGHT}
    columns |= {} if is_narrow else {"effort": RIGHT, "speed": RIGHT}
    columns |= {"group": FOLD, "home": RIGHT}
    rows = (_cells(config, index, joint, is_narrow=is_narrow) for index, joint in enumerate(config.robot.joints))
    return table(columns, rows, padding=(0, 1, 0, 0), collapse_padding=True)


def show_bundled(*, as_json: bool) -> None:
    """Print the bundled robots."""
    configs = {name: load_robot(name, lambda _line: None) for name in bundled()}
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
            for name, config in configs.items()
        ]
        typer.echo(json.dumps({"robots": entries}, indent=2))
        return
    rows: list[list[str | Text]] = []
    for name, config in configs.items():
        counts = (len(config.robot.joints), commanded_count(config.robot), len(config.arms), len(config.grippers))
        rows.append([Text(name), *map(str, counts)])
    columns = {"robot": WHOLE, **dict.fromkeys(("joints", "commanded", "arms", "grippers"), RIGHT)}
    print_table(_console(), table(columns, rows))


def _cells(config: RobotConfig, index: int, joint: Joint, *, is_narrow: bool) -> list[str | Text]:
    on = str(parent_index(config, joint))
    group = ", ".join(_label(config, key) for key in groups_of(config, joint))
    if joint.mimic is not None:
        group = f"{group}, mimic" if group else "mimic"
    home = config.home.get(joint.name)
    limits = joint.limits
    is_fixed = joint.type is JointType.FIXED
    numbers = [limits.lower, limits.upper, *([] if is_narrow else [limits.effort, limits.velocity])]
    figures = ["" if is_fixed else _figure(number) for number in numbers]
    names: list[str | Text] = [str(index), Text(joint.name), str(joint.type), Text(joint.child), on]
    return [*names, *figures, group, "" if home is None else _figure(home)]


def _label(config: RobotConfig, key: str) -> str:
    """Return a group's label in a narrow column: R and L (right, left) if there are two."""
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
        notes.append(("bounds", f"accelerations [rad/s²; m/s²]: {bounds}"))
    if config.fixed_link is not None:
        notes.append(("fixed", f"{config.fixed_link} is fixed to the world instead of the root"))
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
    return Console(highlight=False, width=None if sys.stdout.isatty() else _MAX_WIDTH)


def _figure(number: float) -> str:
    """Return a number in few characters; a dash if there is no limit."""
    return f"{round(number, 3) + 0.0:.4g}" if math.isfinite(number) else "-"


def robot(
    name: Annotated[str | None, argument("ROBOT", ROBOT_HELP)] = None,
    xacro_arguments: XacroArguments = None,
    as_json: Annotated[bool, flag("--json", "Print joints, groups and the poses of all links as JSON.")] = False,
    pose: Annotated[
        str | None,
        option(
            "JSON",
            "With --json: joint positions for the poses of the links, such as "
            """`'{"elbow": 1.57}'`; other joints are at 0 [rad; m].""",
        ),
    ] = None,
    init: Annotated[
        Path | None,
        option(
            "FILE.yml",
            "Write a draft of a robot configuration for a URDF, with arms, grippers and head guessed from names and "
            "joints.",
        ),
    ] = None,
    rosetta: Annotated[
        Path | None,
        option("FILE.yaml", "Write the contract of the robot's node for rosetta, which records data sets in ROS 2."),
    ] = None,
) -> None:
    """List the joints of a robot: index, type, links, limits, and groups of the configuration.

    Robot configuration files use these indices: parents before children, children in the order of their elements in the
    URDF, fixed joints counted. The link that a joint moves has the joint's index, and the root link has -1. Without an
    argument, the command lists the bundled robots.

        cellwright robot qinglong                  # a bundled robot
        cellwright robot my_robot/vr_configs.yml   # check the indices
        cellwright robot my_robot.urdf --json      # for programs
        cellwright robot arm.urdf.xacro prefix:=left_
        cellwright robot my_robot.urdf --init vr_configs.yml
        cellwright robot qinglong --rosetta contract.yaml

    With `--json`: `joints` in the order of their indices, and under `links` the pose of each link's frame in the world,
    `[[x, y, z], [qx, qy, qz, qw]]`, with the root link at the origin. A null limit means no limit. Fixed joints have
    the limits 0 and -1 and no axis, as PyBullet reports them.

    Exit status: 0 done, 2 the file or the pose cannot be used.
    """
    if name is None:
        for option, value in (("--pose", pose), ("--init", init), ("--rosetta", rosetta)):
            if value is not None:
                refuse(f"{option} requires a robot")
        show_bundled(as_json=as_json)
        raise typer.Exit(DONE)
    if pose is not None and not as_json:
        refuse("--pose requires --json")
    if init is not None and (as_json or init.suffix.lower() not in (".yml", ".yaml")):
        refuse(f"--init {init}: give a file such as vr_configs.yml, and no --json")
    if rosetta is not None and (as_json or init is not None):
        refuse(f"--rosetta {rosetta}: give it alone, without --json and --init")
    config = load_robot(name, output.warn, options.xacro_arguments(xacro_arguments))
    if init is not None:
        write_skeleton(config, init)
    elif rosetta is not None:
        from cellwright.robot.rosetta import rosetta_contract

        _write_new("--rosetta", rosetta, rosetta_contract(config))
        typer.echo(f"{rosetta}: contract of {config.name} for rosetta")
    elif as_json:
        positions = read_pose(pose, config.robot) if pose is not None else {}
        typer.echo(json.dumps(robot_document(config, positions), indent=2, allow_nan=False))
    else:
        show_robot(config)
    raise typer.Exit(DONE)
