"""`cellwright serve`: a cell for programs in other processes."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli import options, recorded, videos
from cellwright.cli.arguments import (
    END,
    OUTPUT,
    REACH,
    WORK,
    Development,
    Files,
    Host,
    Log,
    Port,
    Record,
    Seed,
    Servo,
    Until,
    Vary,
)
from cellwright.cli.serve.trial import EXIT_ON_COMPLETION, ServeOptions, serve_trial
from cellwright.cli.view.arguments import LOOK, Open, View, ViewHost, ViewPort, page_wish, refuse_a_camera
from cellwright.middleware.server.server import LOOPBACK


def serve(
    files: Files,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="FACTOR",
            help=f"Simulated seconds a second, or `max`. Default: {options.SPEED}, else 1; in lockstep `max`.",
            rich_help_panel=WORK,
        ),
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option("--lockstep", metavar="", help="Let time pass only when a guest asks.", rich_help_panel=WORK),
    ] = False,
    servo: Servo = None,
    seed: Seed = None,
    vary: Vary = False,
    development: Development = False,
    until: Until = None,
    exit_on_completion: Annotated[
        bool,
        typer.Option(
            "--exit-on-completion",
            metavar="",
            help=f"Stop when the competition is done; also with {EXIT_ON_COMPLETION} set.",
            rich_help_panel=END,
        ),
    ] = False,
    host: Host = LOOPBACK,
    port: Port = None,
    ros1: Annotated[
        bool,
        typer.Option(
            "--ros1",
            metavar="",
            help="Be the simulator of ROS 1 programs too, at the master that ROS_MASTER_URI names.",
            rich_help_panel=REACH,
        ),
    ] = False,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            metavar="",
            help="Print the result as JSON at the end, and nothing else on stdout.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    log: Log = None,
    record: Record = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png",
            help="Write a picture of the cell at the end, unless it is stopped with the competition not done.",
            rich_help_panel=LOOK,
        ),
    ] = None,
    camera: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Where it is taken from: overview, bins, belt, agv1, agv2, or `x,y,z:x,y,z` [m].",
            rich_help_panel=LOOK,
        ),
    ] = "overview",
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: Open = False,
    video: videos.File = None,
    video_camera: videos.From = None,
    video_speed: videos.Speed = 1.0,
    video_size: videos.Size = videos.USUAL_SIZE,
    video_fine: videos.Fine = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", "-v", metavar="", help="Say also how time kept to the wall clock.", rich_help_panel=OUTPUT
        ),
    ] = False,
) -> None:
    """Run a trial for programs in other processes, until Ctrl-C; then print its score.

    Programs connect over a socket; what happens is a line each.

        # the lesson's cell, in real time
        cellwright serve lesson

        # the same, and a page to look at it
        cellwright serve lesson --view

        # time passes only when a program asks for it: the same result on any host
        cellwright serve lesson --lockstep

        # then, in another terminal: your program works that cell
        cellwright run --connect 127.0.0.1:11399 --agent my_robot.py:MyRobot

        # the same cell for programs of ROS 1, with a master if there is none
        cellwright serve lesson --ros1

    Exit status: 0 stopped, by whatever was asked for; 1 the simulation became unstable, or a file that was asked
    for is not whole; 2 bad input, and nothing was started.
    """
    refuse_a_camera(files, view=view)
    kept = recorded.wanted(record, agent="served")
    wanted = ServeOptions(
        files=files,
        record=None if kept is None else replace(kept, is_varied=vary),
        speed=_speed(speed, lockstep=lockstep),
        lockstep=lockstep,
        servo=servo,
        seed=options.seed(seed),
        competition=not development,
        until=options.until(until),
        ends_when_done=exit_on_completion or EXIT_ON_COMPLETION in os.environ,
        host=host,
        port=port,
        ros1=ros1,
        as_json=as_json,
        log=options.output_file("--log", log, ".jsonl"),
        picture=options.output_file("--picture", picture, ".png"),
        camera=options.camera(camera),
        video=videos.wish(video, video_camera, video_speed, video_size, fine=video_fine),
        verbose=verbose,
        page=page_wish(view=view, host=view_host, port=view_port, opens=open_page),
    )
    raise typer.Exit(serve_trial(partial(options.trial, files, seed, is_varied=vary), wanted))


def _speed(text: str | None, *, lockstep: bool) -> float | None:
    if text is None and not lockstep:
        return options.default_speed(os.environ)
    return options.speed("max" if text is None else text)
