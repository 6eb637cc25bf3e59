"""Command `cellwright export`: recordings as a data set for learning or a table, and the check of a data set."""

import os
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli import options, output
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.parameters import argument, option
from cellwright.util.plugins import is_installed

_PACKAGES = {"pyarrow": "parquet", "av": "video"}
"""Packages that are needed, and their extras; a table needs the first one."""

_TABLE = ".parquet"


def export(
    recordings: Annotated[
        list[Path] | None,
        argument("RECORDING", "Complete recordings from `--record`, or bags of ROS; each is an episode."),
    ] = None,
    out: Annotated[
        Path | None, option("PATH", "Folder of the data set, which must not exist; or FILE.parquet, for a table.")
    ] = None,
    hz: Annotated[int, option("N", "Frames per second; a frame is whole ticks.")] = 20,
    cameras: Annotated[str, option("NAMES", "Cameras of the pictures, with commas. Default: none.")] = "",
    sentence: Annotated[str, option("TEXT", "The task in words. Default: that of the trial.")] = "",
    check: Annotated[Path | None, option("FOLDER", "Check a data set of this or another program instead.")] = None,
) -> None:
    """Export recordings as a data set for learning, LeRobotDataset v3.0, or as a table; or check a data set.

    Each recorded run is repeated from its commands, of an agent, a policy, a person or a program over ROS. A frame has
    what was measured at its begin, the executed action until its end, and the pictures. Bags of ROS are not repeated:
    they need joint states, what was executed, and the pictures of the cameras.

        cellwright run pick_from_bin --record run.mcap
        cellwright export run.mcap --out picks --cameras overhead,wrist
        cellwright export --check picks
        cellwright export run.mcap --out run.parquet

    The data set is written whole or not at all. After a stop or an error, the same command goes on from the finished
    episodes. A check prints a line for each problem, or ok. With the recordings of the episodes, in any order, it also
    replays the actions in environments, and counts how many of the successes succeed again.

    A table is of one recording of Cellwright: a row for each frame, a column for each value, and pictures as PNG files.

    Exit status: 0 done; 1 the data set has problems, not all succeed again, or it could not be written; 2 bad input.
    """
    is_table = check is None and out is not None and out.suffix.lower() == _TABLE
    needed = [*_PACKAGES][: 1 if is_table else None]
    for name in needed:
        if not is_installed(name):
            extras = ",".join(_PACKAGES[each] for each in needed)
            options.refuse(f"export: needs the package {name}; pip install 'cellwright[{extras}]'")
    if check is not None:
        if out is not None:
            options.refuse("--check: takes no --out; check the folder alone, or with its recordings")
        raise typer.Exit(_checked(check) or (_replayed(check, recordings) if recordings else DONE))
    if not recordings or out is None:
        options.refuse("export: give recordings and --out FOLDER, or --check FOLDER")
    names = [name.strip() for name in cameras.split(",") if name.strip()]
    try:
        if is_table:
            _write_table(recordings, out, hz, names, sentence)
        else:
            _write_set(recordings, out, hz, names, sentence)
    except OSError as error:
        output.echo(f"{out}: cannot be written: {error.strerror or error}", err=True)
        raise typer.Exit(NOT_DONE) from None
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


def _write_set(recordings: list[Path], out: Path, hz: int, cameras: list[str], sentence: str) -> None:
    from cellwright.recording.dataset.export import export_recordings, unfinished_folder

    def report(count: int, frames: int) -> None:
        output.echo(f"episode     {count} of {len(recordings)}, {frames} frames so far")

    try:
        export_recordings(recordings, out, hz=hz, cameras=cameras, sentence=sentence, on_progress=report)
    finally:
        if os.path.exists(unfinished_folder(out)):
            output.echo(f"unfinished  {unfinished_folder(out)}; the same command goes on from there", err=True)
    output.echo(f"data set    {out}")


def _write_table(recordings: list[Path], out: Path, hz: int, cameras: list[str], sentence: str) -> None:
    from cellwright.clients.operators.bags import is_bag
    from cellwright.recording.opened import Recording

    [file, *others] = recordings
    if others or is_bag(file):
        got = f"{len(recordings)} files" if others else f"the bag {file}"
        options.refuse(
            f"--out {out}: a table is of one recording of Cellwright (got {got}); name a folder for a data set"
        )
    if sentence:
        options.refuse("--sentence: is for data sets; leave it out for a table")
    options.output_file("--out", out, _TABLE)
    with Recording(file) as run:
        data = run.dataset(hz, cameras)
    data.to_parquet(out)
    output.echo(f"table       {out}, {data.frames} rows")
