"""Command `cellwright export`: recordings as a data set for learning, and the check of one."""

from collections.abc import Iterator
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
        list[Path] | None, argument("FILE.mcap", "Complete recordings from `--record`; each becomes an episode.")
    ] = None,
    out: Annotated[Path | None, option("FOLDER", "Folder of the data set; it must not exist.")] = None,
    hz: Annotated[int, option("N", "Frames per second; a frame is whole ticks.")] = 20,
    cameras: Annotated[str, option("NAMES", "Cameras whose pictures are drawn, with commas. Default: none.")] = "",
    sentence: Annotated[str, option("TEXT", "The task in words. Default: that of the trial.")] = "",
    check: Annotated[Path | None, option("FOLDER", "Check a data set of this or another program instead.")] = None,
) -> None:
    """Export recordings as a data set for learning, LeRobotDataset v3.0, or check one.

    Each recorded run is repeated from its commands, of an agent, a policy, a person or a program over ROS. A frame has
    what was measured at its begin, the executed action until its end, and the pictures.

        cellwright run pick_from_bin --record run.mcap
        cellwright export run.mcap --out picks --cameras overhead,wrist
        cellwright export --check picks

    The data set is written whole or not at all. A check prints a line for each problem, or ok.

    Exit status: 0 done; 1 the data set has problems, or could not be written; 2 bad input.
    """
    for name in _PACKAGES:
        if not is_installed(name):
            options.refuse(f"export: needs the package {name}; pip install 'cellwright[parquet,video]'")
    if check is not None:
        if recordings or out is not None:
            options.refuse("--check: takes no recordings and no --out; check the folder alone")
        raise typer.Exit(_checked(check))
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


def _write(recordings: list[Path], out: Path, hz: int, cameras: list[str], sentence: str) -> None:
    from cellwright.recording.dataset.episode import Episode
    from cellwright.recording.dataset.lerobot import write_lerobot
    from cellwright.recording.dataset.recorded import recorded_episode
    from cellwright.recording.format.reader import RecordingFile

    for path in recordings:  # a file that is none is refused before the first run is repeated
        with RecordingFile(path):
            pass

    def episodes() -> Iterator[Episode]:
        for path in recordings:
            yield recorded_episode(path, hz, cameras, sentence=sentence)

    def report(count: int, frames: int) -> None:
        output.echo(f"episode     {count} of {len(recordings)}, {frames} frames so far")

    try:
        write_lerobot(out, episodes(), report)
    except OSError as error:
        output.echo(f"{out}: cannot be written: {error.strerror or error}", err=True)
        raise typer.Exit(NOT_DONE) from None
