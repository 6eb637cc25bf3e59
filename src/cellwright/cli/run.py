"""`cellwright run`: a cell from its file to its score."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cellwright.agents.agent import find_agent
from cellwright.cell import Cell
from cellwright.cli import options, score_table
from cellwright.cli.progress import RunProgress
from cellwright.run import Outcome, RunOptions, RunResult, run_cell, versions
from cellwright.viewer.camera import Camera
from cellwright.viewer.picture import save_picture
from cellwright.viewer.views import view


def run(
    files: options.Files,
    agent: Annotated[
        str,
        typer.Option(
            help="What works the cell: `lesson`, `path.py:Class`, `module:Class`, or `none`.", metavar="AGENT"
        ),
    ] = "lesson",
    servo: Annotated[
        str | None,
        typer.Option(help="Servos of the arm: `original` (soft, as in 2017) or `precise`.", metavar="PROFILE"),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Root of all chance; the file's own, else 0.", min=0)] = None,
    speed: Annotated[
        float | None, typer.Option(help="Simulated seconds a second, such as 1; as fast as it goes when left out.")
    ] = None,
    until: Annotated[float | None, typer.Option(help="Stop at this simulation time [s].", min=0.0)] = None,
    development: Annotated[
        bool,
        typer.Option("--development-mode", "-d", help="Allow what a competition refuses, such as setting the belt."),
    ] = False,
    min_score: Annotated[float | None, typer.Option(help="Exit with status 1 when the score is below this.")] = None,
    snapshot: Annotated[
        list[str] | None,
        typer.Option(help="Take a picture at a simulation time [s]; may be repeated.", metavar="T:FILE.png"),
    ] = None,
    view_name: Annotated[
        str, typer.Option("--view", help="Where pictures are taken from: overview, bins, belt, agv1, agv2.")
    ] = "overview",
    listen: Annotated[
        list[str] | None,
        typer.Option(help="Listen to a topic besides and count its messages; `all` for every topic.", metavar="TOPIC"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")] = False,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Write a picture of the cell at the end to TRIAL.png.")
    ] = True,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say what the agent logs.")] = False,
) -> None:
    """Run a trial headless and print its score.

    Begin with `cellwright run lesson`: the last cell of the ROS class that this project grew from, worked by the
    class's own script. Your own program: `cellwright run lesson --agent my_robot.py:MyRobot`.
    """
    console = Console(stderr=as_json, highlight=False)
    trial = options.load(files)
    make_agent = None if agent == "none" else find_agent(agent)
    if make_agent is None and until is None:
        options.refuse("--agent none: without an agent a run has no end; say --until SECONDS")
    camera = options.attempt(lambda: view(view_name), "--view")
    pictures = [options.snapshot(text) for text in snapshot or ()]
    cell = Cell(
        trial, seed=seed, servo=options.servo(servo), competition=not development, report=partial(_report, console)
    )
    options.topics(listen or (), cell)
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s", stream=sys.stderr)
    console.print(f"trial {trial.name}, agent {agent}, seed {cell.seed}, servo {cell.servo}", markup=False)

    with RunProgress(console, cell, until) as progress:
        result = run_cell(
            cell,
            None if make_agent is None else make_agent(),
            RunOptions(
                speed=speed,
                until=until,
                listen=listen or (),
                at=[(when, _photographer(file, camera)) for when, file in pictures],
                on_progress=progress.update,
            ),
        )
    if result.error:
        sys.stderr.write(result.error)
    status = exit_status(result, min_score)
    written = [str(file) for _, file in pictures if file.exists()]
    if picture:
        with console.status("drawing the picture"):
            file = Path(f"{trial.name}.png")
            save_picture(file, *cell.seen, camera)
        written.append(str(file))
    if as_json:
        sys.stdout.write(json.dumps(document(cell, agent, result, status, written), indent=2) + "\n")
    else:
        score_table.show(console, cell.trial, result, min_score, written)
    raise typer.Exit(status)


def exit_status(result: RunResult, min_score: float | None) -> int:
    """0 when the competition was done, with at least the score that was asked for; else 1."""
    if result.outcome is not Outcome.DONE:
        return 1
    return 1 if min_score is not None and result.score.total < min_score else 0


def document(cell: Cell, agent: str, result: RunResult, status: int, pictures: list[str]) -> dict[str, Any]:
    """A run's result as JSON values; times in s."""
    return {
        "trial": cell.trial.name,
        "agent": agent,
        "seed": cell.seed,
        "servo": cell.servo,
        "timestep": float(Fraction(*cell.trial.settings.timestep)),
        "outcome": result.outcome.name.lower(),
        "exit_status": status,
        "competition_state": result.competition_state,
        "simulated": result.simulated,
        "wall": result.wall,
        "real_time_factor": result.real_time_factor,
        "steps": result.steps,
        "state_hash": result.state_hash,
        "score": score_table.document(result.score, cell.trial),
        "heard": result.heard,
        "refused": dict(cell.bus.refusals.counts),
        "pictures": pictures,
        "versions": versions(),
    }


def _photographer(file: Path, camera: Camera) -> Callable[[Cell], None]:
    return lambda cell: save_picture(file, *cell.seen, camera)


def _report(console: Console, line: str) -> None:
    console.print(line, markup=False, soft_wrap=True, style="yellow")
