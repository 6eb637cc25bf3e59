"""Command `cellwright`: its subcommands, loaded on demand, their options, exit statuses, and errors."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup

from cellwright._package import VERSION
from cellwright.util.errors import CellwrightError, UsageError, printable
from cellwright.util.process import silent_ctrl_c

if TYPE_CHECKING:
    from cellwright.running.run import RunResult

DONE = 0
"""The request is done."""
NOT_DONE = 1
"""It was started and not done.

Reasons: time limit, --until came first, agent gave up or crashed, below --min-score, interrupted.
"""
BAD_INPUT = 2
"""The input is not valid; nothing has been started."""
INCONCLUSIVE = 3
"""Nothing could be judged.

A comparison shows neither a loss nor that there is none, and more seeds would tell; or no trial
has an order.
"""
TRY_AGAIN = 75
"""Runs are left without a result, because the machine failed or a signal came; the same command continues.

Schedulers tell it from the others, which are final. (EX_TEMPFAIL of sysexits.h)
"""
INTERRUPTED = 130
"""Ctrl-C ended a command that had no result by then, such as while it read its files; Typer's status too."""

_ROOM = "cellwright.cli"
COMMANDS = {
    "run": "run.command:run",
    "check": "check:check",
    "cell": "cell.command:app",
    "eval": "eval.command:evaluate",
    "eval merge": "eval.merge:merge",
    "eval compare": "eval.compare:compare",
    "serve": "serve:serve",
    "env": "env.command:app",
    "teleop": "teleop.command:teleop",
    "view": "view:view",
    "replay": "replay.command:replay",
    "plot": "plot:plot",
    "export": "export:export",
    "trials": "trials:trials",
    "robot": "robot:robot",
    "ros1-env": "ros1:ros1_env",
    "ros1-workspace": "ros1:ros1_workspace",
    "ros2-env": "ros2:ros2_env",
    "ros2-workspace": "ros2:ros2_workspace",
    "operate": "operate.command:app",
}
"""Module of each command, below this package, in the order of the help: a function, or an app of several commands.

A name of two words comes before that of one: `eval merge` is a command, and `eval lesson` is `eval` with an argument.
"""
_ROS_ARGUMENTS = "--ros-args"


def exit_status_of(result: RunResult, *, has_agent: bool, min_score: float | None) -> int:
    """Return the exit status of a run; a run without an agent is done when it has reached its `--until`."""
    from cellwright.running.run import Outcome  # slow to load, and other commands need the figures above alone

    if result.outcome is Outcome.NO_ORDER:
        return INCONCLUSIVE
    if result.success is False:
        return NOT_DONE
    if min_score is not None and result.score.total < min_score:
        return NOT_DONE
    is_done = result.outcome is Outcome.DONE or (result.outcome is Outcome.UNTIL and not has_agent)
    return DONE if is_done else NOT_DONE


class OnceCommand(TyperCommand):
    """Command that takes one agent: of two, the last would run, and the first in silence not."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments; an agent that is given twice is refused."""
        _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        if sum(parameter.name == "agent" for parameter in order) > 1:
            raise UsageError("--agent: given twice; run one program at a time, and see `cellwright eval compare`")
        return super().parse_args(ctx, args)


class CommandsOnDemand(TyperGroup):
    """Command group that loads each command on demand."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = cast("Any", MappingProxyType(COMMANDS))  # for suggestions, which need the names alone

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002
        """Return their names; this loads none of them."""
        return [*COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """Load a command; None if there is none of this name."""
        return _loaded(cmd_name) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name of the command in the first words, the command, and the words behind it."""
        two = " ".join(args[:2])
        return super().resolve_command(ctx, [two, *args[2:]] if two in COMMANDS else args)


@cache
def _loaded(name: str) -> Any:
    module, _, attribute = COMMANDS[name].partition(":")
    with silent_ctrl_c():
        loaded = getattr(import_module(f"{_ROOM}.{module}"), attribute)
    if isinstance(loaded, typer.Typer):
        return typer.main.get_command(loaded)
    alone = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)
    alone.command(name, cls=OnceCommand)(loaded)
    return typer.main.get_command(alone)


app = typer.Typer(
    name="cellwright",
    cls=CommandsOnDemand,
    help="""Simulate industrial robot cells, and score the agents that work them.

    A YAML file describes the cell, its orders and its faults, in the format of the ARIAC competition of 2017. An agent
    works the cell, and the referee scores it. Begin with:

        cellwright run lesson        # a bundled trial, and its score
        cellwright run --help        # your own agent, pictures, servos, JSON
        cellwright trials            # list the bundled trials
        cellwright eval lesson       # many runs, scored, and a report
        cellwright serve lesson      # a cell for programs in other processes
        cellwright env --help        # an environment for other processes
        cellwright plot run.mcap     # a figure of a recording
        cellwright export --help     # recordings as a data set for learning
        cellwright view lesson       # a trial, robot, recording or server
        cellwright check trial.yaml  # errors and warnings of a file
        cellwright teleop qinglong   # a robot's controller node
        cellwright robot qinglong    # a robot's joints, by index
        cellwright operate --help    # drive a robot's controller node
        cellwright replay run.mcap   # inspect and play a recording""",
    epilog="Exit status: 0 done; 1 not done; 2 bad input, and nothing was started; 130 Ctrl-C, and no result.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(requested: bool) -> None:  # noqa: FBT001
    if requested:
        typer.echo(f"cellwright {VERSION}")
        raise typer.Exit


@app.callback()
def _global_options(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, metavar="", help="Show the version and exit.")
    ] = False,
) -> None:
    pass


ros_arguments: list[str] = []
"""Arguments behind `--ros-args`, as ROS 2's launch appends them: rclpy's own, for the node in ROS 2."""


def _split(words: list[str], at: str) -> tuple[list[str], list[str]]:
    """Return the words before the first `at`, and those behind it."""
    position = words.index(at) if at in words else len(words)
    return words[:position], words[position + 1 :]


def main(arguments: Sequence[str] | None = None, command_line: typer.Typer = app, *, name: str = "cellwright") -> int:
    """Run the command line, None for that of the process; return the exit status.

    Errors in the input are printed, a line each.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    arguments, ros_arguments[:] = _split(arguments, _ROS_ARGUMENTS)
    ros_arguments[:], behind = _split(ros_arguments, "--")
    arguments += behind
    if ros_arguments and "--ros2" not in arguments:
        sys.stderr.write(f"error: {_ROS_ARGUMENTS} requires --ros2\n")
        return BAD_INPUT
    try:
        if ros_arguments:
            from cellwright.middleware.ros2.host.arguments import check_ros_arguments

            check_ros_arguments(ros_arguments)
        status = command_line(arguments, prog_name=name, standalone_mode=False)
    except CellwrightError as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"error: {printable(line)}\n")
        return BAD_INPUT
    except typer.TyperException as error:
        message = error.format_message()
        if message:
            context = getattr(error, "ctx", None)  # of the command that was named, if one was
            place = name if context is None else context.command_path
            sys.stderr.write(f"error: {printable(message)} (see {place} --help)\n")
        return BAD_INPUT
    except typer.Abort:
        status = INTERRUPTED
    if status == INTERRUPTED:
        sys.stderr.write("interrupted\n")
    return int(status or 0)
