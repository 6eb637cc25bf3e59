"""Command `cellwright view`: a trial, a robot, a recording or a running server, on a page."""

import os
import re
import time
from collections.abc import Sequence
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cli import options, output
from cellwright.cli.arguments import CellArguments, PageAddress
from cellwright.cli.main import DONE
from cellwright.cli.options import refuse
from cellwright.cli.parameters import argument, with_groups
from cellwright.cli.signals import keep_until_signal
from cellwright.config.robot.robots import load_robot
from cellwright.engine.rate_control import RateControl
from cellwright.running.evaluation.results.folder import PLAN_NAME, RESULTS_NAME
from cellwright.running.run import PageOptions, RunOptions, ServerOptions, loading, pages
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PAGE, PANEL
from cellwright.viewer.web.connection import ServerConnection

_ADDRESS = re.compile(r"[^/\\]+:[0-9]{1,5}")


class TargetKind(Enum):
    """Kind of a thing to view."""

    EVALUATION = "an evaluation"

    TRIAL = "a trial"
    ROBOT = "a robot"
    RECORDING = "a recording"
    ADDRESS = "a server"


def kind_of(words: Sequence[str]) -> TargetKind:
    """Return the kind of the words of a command line; words of no other kind are a trial."""
    kinds = [_kind_of_word(word) for word in words]
    if len(words) > 1 and set(kinds) not in ({TargetKind.TRIAL}, {TargetKind.EVALUATION}):
        other = next(word for word, kind in zip(words, kinds, strict=True) if kind is not TargetKind.TRIAL)
        refuse(f"{other}: cannot be joined; give one target, several files of a trial, or shards of an evaluation")
    return kinds[0]


def _kind_of_word(word: str) -> TargetKind:
    path = Path(word)
    if any(os.path.exists(path / name) for name in (PLAN_NAME, RESULTS_NAME)):
        return TargetKind.EVALUATION
    if path.suffix.lower() in loading.RECORDINGS:
        return TargetKind.RECORDING
    if _ADDRESS.fullmatch(word) and not os.path.exists(path):
        return TargetKind.ADDRESS
    return TargetKind.ROBOT if loading.is_robot(word) else TargetKind.TRIAL


def view_served(address: tuple[str, int], page_settings: PageOptions, console: Console) -> None:
    """Show the node of a server until a signal comes, also when the server has gone and come back meanwhile."""
    title = f"{served_name(address)} · Cellwright"
    keep_until_signal(lambda: pages.open_page(address, page_settings, title, partial(output.print_line, console)))


def served_name(address: tuple[str, int]) -> str:
    """Return the name of the node of a server, if a page can show it."""
    link = ServerConnection(address, node=f"{PAGE}asks")
    try:
        return str(link.ask(PANEL)["name"])
    except (CellwrightError, KeyError) as error:
        refuse(f"{address[0]}:{address[1]}: cannot be shown: {error}")
    finally:
        link.close()


@with_groups
def view(
    words: Annotated[
        list[str],
        argument(
            "TARGET",
            "A trial or a robot, by name or file; a recording (`run.mcap`); the folder of an evaluation; or the "
            "HOST:PORT of a server.",
        ),
    ],
    address: PageAddress,
) -> None:
    """Show a trial, a robot, a recording, an evaluation or a server on a page in a browser, until Ctrl-C.

    The page's address is printed. A trial and a recording start paused. A trial is in development mode. An evaluation
    may be in progress, on this machine or on others that write to the same disk.

        # the lesson's cell
        cellwright view lesson

        # a robot, which the page drives as well
        cellwright view qinglong

        # a recording
        cellwright view run.mcap

        # all shards of an evaluation
        cellwright view shards/*

        # the server of `cellwright serve -d` or `cellwright teleop`; a competition has only its own page
        cellwright view 127.0.0.1:11399

    Exit status: 0 stopped by Ctrl-C; 2 bad input, and nothing was started.
    """
    page = address.options()
    console, here = Console(highlight=False), ServerOptions(port=0)
    match kind_of(words):
        case TargetKind.ADDRESS:
            view_served(options.address("view", words[0]), page, console)
        case TargetKind.EVALUATION:
            from cellwright.cli.eval.watch import open_evaluation_page

            folders = [Path(word) for word in words]
            keep_until_signal(lambda: open_evaluation_page(folders, "", page, console))
        case TargetKind.RECORDING:
            # slow to load, and the other commands do without it
            from cellwright.cli.replay.actions import play_recording
            from cellwright.recording.replay.playback import AtEnd
            from cellwright.running.run.playback import PlaybackTarget

            target = PlaybackTarget(options.paths(words)[0], at_end=AtEnd.HOLD)
            play_recording(target, console, rate=RateControl(1.0, paused=True), serve=here, view=page)
        case TargetKind.ROBOT:
            from cellwright.cli.teleop.node import robot_progress, robot_session, run_robot
            from cellwright.robot.node import RobotNode
            from cellwright.running.run.robots import RobotTarget

            progress = robot_progress(console, until=None)

            def make() -> RobotNode:
                return RobotNode(load_robot(words[0], output.warn), stamp=time.time_ns, report=progress.notice)

            shown = robot_session(RobotTarget(make), console, progress, speed=1.0, serve=here, view=page)
            raise typer.Exit(run_robot(shown, console))
        case TargetKind.TRIAL:
            from cellwright.cli.serve import run_served, served_session

            cell = CellArguments().target(words, console, competition=False)
            rate = RateControl(1.0, paused=True)
            shown = served_session(
                cell, console, rate=rate, serve=here, view=page, options=RunOptions(ends_when_done=False)
            )
            raise typer.Exit(run_served(shown, console))
    raise typer.Exit(DONE)
