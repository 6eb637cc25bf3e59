"""Command `cellwright export`: recordings as a data set for learning, and the check of one."""

import os
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli import options, output
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.parameters import argument, option
from cellwright.util.plugins import is_installed

_PACKAGES = ("pyarrow", "av")


def export(
    recordings: Annotated[
        list[Path] | None,
        argument("RECORDING", "Complete recordings from `--record`, or bags of ROS; each is an episode."),
    ] = None,
    out: Annotated[Path | None, option("FOLDER", "Folder of the data set; it must not exist.")] = None,
    hz: Annotated[int, option("N", "Frames per second; a frame is whole ticks.")] = 20,
    cameras: Annotated[str, option("NAMES", "Cameras of the pictures, with commas. Default: none.")] = "",
    sentence: Annotated[str, option("TEXT", "The task in words. Default: that of the trial.")] = "",
    check: Annotated[Path | None, option("FOLDER", "Check a data set of this or another program instead.")] = None,
) -> None:
    """Export recordings as a data set for learning, LeRobotDataset v3.0, or check one.

    Each recorded run is repeated from its commands, of an agent, a policy, a person or a program over ROS. A frame has
    what was measured at its begin, the executed action until its end, and the pictures. Bags of ROS are not repeated:
    they need joint states, what was executed, and the pictures of the cameras.

        cellwright run pick_from_bin --record run.mcap
        cellwright export run.mcap --out picks --cameras overhead,wrist
        cellwright export --check picks

    The data set is written whole or not at all. After a stop or an error, the same command goes on from the finished
    episodes. A check prints a line for each problem, or ok. With the recordings of the episodes it also replays the
    actions in environments, and counts how many of the successes succeed again.

    Exit status: 0 done; 1 the data set has problems, not all succeed again, or it could not be written; 2 bad input.
    """
    for name in _PACKAGES:
        if not is_installed(name):
            options.refuse(f"export: needs the package {name}; pip install 'cellwright[parquet,video]'")
    if check is not None:
        if out is not None:
            options.refuse("--check: takes no --out; check the folder alone, or with its recordings")
        raise typer.Exit(_checked(check) or (_replayed(check, recordings) if recordings else DONE))
    if not recordings or out is None:
        options.refuse("export: give recordings and --out FOLDER, or --check FOLDER")
    _write(recordings, out, hz, [name.strip() for name in cameras.split(",") if name.strip()], sentence)
    output.echo(f"data set    {out}")
    raise typer.Exit(DONE)


def _checked(folder: Path) -> int:
    """Print what is wrong with a data set; return the exit status."""
    from cellwright.recording.dataset.check import check_lerobot

    problems = check_lerobot(folder)
    for problem in problems or ["ok"]:
        output.echo(problem)
    return NOT_DONE if problems else DONE


def _replayed(folder: Path, recordings: list[Path]) -> int:
    """Replay the actions of a data set, and print how many of the successes succeed again; return the exit status."""
    if not is_installed("gymnasium"):
        options.refuse("--check: replaying needs the package gymnasium; pip install 'cellwright[gym]'")
    from cellwright.recording.dataset.replayed import replay_actions

    successes = again = 0
    for each in replay_actions(folder, recordings):
        successes += each.was_success
        again += each.was_success and each.is_success
        if each.was_success and not each.is_success:
            output.echo(f"episode     {each.number}, {each.source}: succeeded, but its actions do not")
    output.echo(f"replayed    {again} of {successes} successes succeed again")
    return DONE if again == successes else NOT_DONE


def _write(recordings: list[Path], out: Path, hz: int, cameras: list[str], sentence: str) -> None:
    from cellwright.recording.dataset.export import export_recordings, unfinished_folder

    def report(count: int, frames: int) -> None:
        output.echo(f"episode     {count} of {len(recordings)}, {frames} frames so far")

    try:
        export_recordings(recordings, out, hz=hz, cameras=cameras, sentence=sentence, on_progress=report)
    except OSError as error:
        output.echo(f"{out}: cannot be written: {error.strerror or error}", err=True)
        raise typer.Exit(NOT_DONE) from None
    finally:
        if os.path.exists(unfinished_folder(out)):
            output.echo(f"unfinished  {unfinished_folder(out)}; the same command goes on from there", err=True)
