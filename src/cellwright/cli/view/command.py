"""`cellwright view`: whatever there is to be seen, on a page."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.exit_status import DONE
from cellwright.cli.serve.trial import ServeOptions, serve_trial
from cellwright.cli.teleop.node import run_node
from cellwright.cli.teleop.options import TeleopOptions
from cellwright.cli.view.arguments import Open, PageWish, ViewHost, ViewPort, page_wish
from cellwright.cli.view.kind import Kind, kind_of
from cellwright.cli.view.served import watch
from cellwright.config.robot.robots import load_robot


def view(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="WHAT",
            help="A trial or a robot, by name or file; a recording (`run.mcap`); or the HOST:PORT of what is served.",
            show_default=False,
        ),
    ],
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: Open = False,
) -> None:
    """Show a trial, a robot, a recording, or something that is served, on a page in a browser, until Ctrl-C.

    The page's address is printed. A trial and a recording stand at their start: look around, then let them go on. A
    trial is in development mode.

        # the lesson's cell
        cellwright view lesson

        # a robot, which the page drives as well
        cellwright view qinglong

        # what was recorded
        cellwright view run.mcap

        # what `cellwright serve -d` or `cellwright teleop` has there; a competition shows its own page alone
        cellwright view 127.0.0.1:11399

    Exit status: 0 stopped by Ctrl-C; 2 bad input, and nothing was started.
    """
    page = page_wish(view=True, host=view_host, port=view_port, opens=open_page) or PageWish()
    console = Console(highlight=False)
    match kind_of(what):
        case Kind.ADDRESS:
            watch(options.address("view", what[0]), page, console)
        case Kind.RECORDING:
            # it takes a moment to load, which the other commands are spared
            from cellwright.cli.replay.play import PlayOptions, play
            from cellwright.recording.format.reader import Recording
            from cellwright.recording.replay.playing import AtEnd

            with Recording(options.paths(what)[0]) as recording:
                play(recording, PlayOptions(at_end=AtEnd.HOLD, port=0, page=page, paused=True), console)
        case Kind.ROBOT:
            raise typer.Exit(run_node(partial(load_robot, what[0]), TeleopOptions(port=0, page=page)))
        case Kind.TRIAL:
            shown = ServeOptions(port=0, competition=False, paused=True, page=page)
            raise typer.Exit(serve_trial(partial(options.load, what), shown))
    raise typer.Exit(DONE)
