"""Command `cellwright serve`: a cell for programs in other processes, and the service for its result."""

import io
import itertools
import json
import os
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cli import options, output, summary
from cellwright.cli.arguments import (
    END,
    LOCKSTEP_HELP,
    OUTPUT,
    SIMULATION,
    SPEED_HELP,
    VIEWING,
    AsJson,
    CellArguments,
    Development,
    Files,
    Log,
    NetworkArguments,
    PageArguments,
    PictureCamera,
    Record,
    Until,
    VideoArguments,
    record_options,
)
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.parameters import flag, option, with_groups
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.config.trial.trial import Trial
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import WORLD_CHANGE
from cellwright.rendering.views import OVERVIEW, Viewpoint
from cellwright.running.run import CellTarget, Outcome, RunOptions, ServerOptions, Session, WorldOptions, cell_result
from cellwright.running.run.observers import Pictures
from cellwright.viewer.services.cell_panel import hides_ground_truth, known_evidence

if TYPE_CHECKING:
    from cellwright.middleware.ros2.host import Ros2

RESULT = "/cellwright/result"
"""Service of the server itself, not of the cell: JSON with the result as a document, and as text for people."""

EXIT_ON_COMPLETION = "ARIAC_EXIT_ON_COMPLETION"
"""Environment variable of the original: with any value the simulator ends when the competition does."""

_WIDTH = 80


@dataclass(frozen=True, kw_only=True)
class ServeArguments:
    """Arguments and options of `cellwright serve`, in the order of its help."""

    files: Files
    speed: Annotated[
        str | None, option("FACTOR", f"{SPEED_HELP} Default: {options.SPEED}, else `1`; in lockstep `max`.", SIMULATION)
    ] = None
    lockstep: Annotated[bool, flag("--lockstep", f"{LOCKSTEP_HELP}.", SIMULATION)] = False
    cell: CellArguments
    development: Development = False
    until: Until = None
    exit_on_completion: Annotated[
        bool,
        flag("--exit-on-completion", f"Stop when the competition is done; also if {EXIT_ON_COMPLETION} is set.", END),
    ] = False
    network: NetworkArguments
    as_json: AsJson = False
    log: Log = None
    record: Record = None
    picture: Annotated[
        Path | None,
        option(
            "FILE.png",
            "Write a picture of the cell at the end, unless stopped before the competition is done.",
            VIEWING,
        ),
    ] = None
    camera: PictureCamera = "overview"
    page: PageArguments
    video: VideoArguments
    verbose: Annotated[bool, flag("--verbose -v", "Print how well time kept up with the wall clock.", OUTPUT)] = False

    def rate(self) -> float | None:
        """Return the real-time factor; None for as fast as possible."""
        if self.speed is None and not self.lockstep:
            return options.default_speed(os.environ)
        return options.speed("max" if self.speed is None else self.speed)

    def session_options(self) -> dict[str, Any]:
        """Return arguments of `Session` that all sessions of the command share."""
        ends_when_done = self.exit_on_completion or EXIT_ON_COMPLETION in os.environ
        return {
            "view": self.page.options() or False,
            "record": record_options(self.record, self.video.options(None), self.log, agent="served"),
            "options": RunOptions(until=options.until(self.until), ends_when_done=ends_when_done),
        }

    @property
    def can_load_worlds(self) -> bool:
        """True if clients may replace the world: nothing of the command refers to the first one."""
        kept = (self.page.view, self.network.ros1, self.lockstep, self.as_json, self.record, self.video.video)
        return self.development and not any((*kept, self.log, self.picture))


@with_groups
def serve(given: ServeArguments) -> None:
    """Serve a trial to programs in other processes, until Ctrl-C; then print its score.

    Programs connect over a socket. Each event is a line of output.

        # the lesson's cell, in real time
        cellwright serve lesson

        # the same, shown on a page
        cellwright serve lesson --view

        # simulation time advances only on a client's request: the same result on any host
        cellwright serve lesson --lockstep

        # then, in another terminal: your agent works that cell
        cellwright run --connect 127.0.0.1:11399 --agent my_robot.py:MyRobot

        # the same cell for ROS 1 programs; starts a master if there is none
        cellwright serve lesson --ros1

        # the same for ROS 2 programs, in a namespace
        cellwright serve lesson --ros2 --ros-args -r __ns:=/cell1

    Exit status: 0 stopped as requested; 1 the simulation became unstable, or a requested file is incomplete; 2 bad
    input, and nothing was started.
    """
    rate, console = given.rate(), Console(stderr=given.as_json, highlight=False)
    camera, picture = options.camera(given.camera), options.output_file("--picture", given.picture, ".png")
    target: CellTarget | None = given.cell.target(
        given.files,
        console,
        competition=not given.development,
        viewpoints={"--camera": camera, **given.video.viewpoints()},
    )
    server, more = given.network.options(lockstep=given.lockstep), given.session_options()
    worlds = WorldChange(partial(given.cell.cell, console=console, competition=False))
    status = DONE
    with closing(worlds):
        while target is not None:
            pace = RateControl(rate, paused=worlds.has_changed)
            loading = worlds.options() if given.can_load_worlds else None
            served = replace(server, port=worlds.port or server.port, worlds=loading)
            session = served_session(target, console, rate=pace, serve=served, **more)
            status = run_served(
                session, console, as_json=given.as_json, picture=picture, camera=camera, verbose=given.verbose
            )
            target = worlds.take(session)
    raise typer.Exit(status)


def served_session(
    target: CellTarget, console: Console, *, rate: RateControl, serve: ServerOptions, options: RunOptions, **more: Any
) -> Session:
    """Return a session that serves a cell, and prints its events on a console; `more` are arguments of `Session`."""
    progress = RunProgress(console, until=options.until, is_served=True)
    return Session(
        target,
        rate=rate,
        serve=replace(serve, on_ready=output.report_ready),
        options=replace(options, observers=[progress]),
        outputs=output.session_outputs(console, partial(progress.line, style="yellow")),
        **more,
    )


def run_served(
    session: Session,
    console: Console,
    *,
    as_json: bool = False,
    picture: Path | None = None,
    camera: Viewpoint = OVERVIEW,
    verbose: bool = False,
) -> int:
    """Serve a cell until it is over or a signal ends it, and print the result; return the exit status."""
    with stopped_by_signals(session.stop.request), session:
        offer_result(session)
        result = cell_result(session.run())
    cell: Cell = session.node
    if result.error:
        typer.echo(result.error, err=True, nl=False)
    if not as_json:
        summary.show_result(console, result)
        if result.pace is not None and (verbose or result.pace.held):
            output.print_entry(console, "pace", output.pace_text(result.pace))
    pictures = Pictures(camera, [], output.warn)
    # After the score, since it takes a while; not if a signal asks for the end at once, before the work is done.
    if result.outcome in (Outcome.DONE, Outcome.NO_ORDER) or not session.stop.is_requested:
        summary.take_picture(console, pictures, picture, cell)
    status = NOT_DONE if result.outcome is Outcome.UNSTABLE else DONE
    status = summary.with_files(status, cell, result, pictures)
    if as_json:
        document = summary.result_document(cell, "served", result, status, pictures.written)
        pace = None if result.pace is None else asdict(result.pace)
        typer.echo(json.dumps(document | {"pace": pace, "videos": result.videos}, indent=2))
    else:
        summary.show_files(console, result, pictures)
    return status


def offer_result(session: Session) -> None:
    """Offer the result to clients. Before the end of a competition it holds only public facts."""
    cell, server = session.node, session.server
    assert server is not None

    def answer(_request: dict[str, Any]) -> dict[str, Any]:
        result = replace(cell_result(session.result_by_now()), evidence=known_evidence(cell))
        text = io.StringIO()
        summary.show_result(Console(file=text, width=_WIDTH, highlight=False), result)
        document = summary.result_document(cell, "served", result, 0, [])
        if hides_ground_truth(cell):
            # with them a client could predict noise and friction, or know of faulty parts
            document |= {"seed": None, "circumstances": None, "overrides": None}
        return {"document": document, "text": text.getvalue()}

    server.offer(RESULT, answer)


class WorldChange:
    """Change of a served development cell to another trial, as clients request it; close it at the end.

    The node of ROS 2 stays. The other trial is stopped at its begin.

    Args:
        cell_of: returns the cell of a trial.
    """

    _POLLS = 3
    """Polls of the session after a request, so that its answer arrives before the connections end."""

    def __init__(self, cell_of: Callable[[Trial], Cell]) -> None:
        self._cell_of = cell_of
        self._next: Cell | None = None
        self._kept = ExitStack()
        self._ros2: Ros2 | None = None
        self.port: int | None = None
        """Port of the session that was to load a world: the next one's too."""

    @property
    def has_changed(self) -> bool:
        """True if a world has replaced that of the command."""
        return self.port is not None

    def close(self) -> None:
        """End what the sessions share."""
        self._kept.close()

    def options(self) -> WorldOptions:
        """Return the options with which the next session loads worlds."""
        return WorldOptions(self.load, self._kept, self._ros2)

    def load(self, session: Session, trial: Trial) -> None:
        """End a session soon, and keep the cell of a trial for the next one."""
        assert session.address is not None
        self._next, self.port = self._cell_of(trial), session.address[1]
        polls = itertools.count(1)

        def stop_soon() -> None:
            if next(polls) == self._POLLS:
                session.stop.request(WORLD_CHANGE)

        session.on_poll.append(stop_soon)

    def take(self, session: Session) -> CellTarget | None:
        """Return the next cell as a target, once; None if the session ended for another reason, as by a signal."""
        cell, self._next = self._next, None
        self._ros2 = None if session.serving is None else session.serving.ros2
        return None if cell is None or session.stop.reason != WORLD_CHANGE else CellTarget(lambda: cell)
