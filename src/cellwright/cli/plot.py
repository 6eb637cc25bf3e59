"""Command `cellwright plot`: a figure of a recording."""

from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli import options, output
from cellwright.cli.arguments import Recorded
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.parameters import option


def plot(
    file: Recorded,
    out: Annotated[
        Path | None, option("FILE", "Figure file, .png, .svg or .pdf. Default: the recording's name with -plot.png.")
    ] = None,
    panels: Annotated[
        str | None, option("NAMES", "Panels, with commas: score, trays, joints, tool, commands. Default: all.")
    ] = None,
) -> None:
    """Plot a recording over simulation time, on one page.

    For a cell: the score with events, the parts on the trays and the referee's verdicts, the arm's joints and their
    targets, the tool's height and path, collisions, and the times of commands. For a robot: its joints by group and
    their targets, the tips of its arms, its safety events, and the source of its commands over time.

        cellwright run lesson --record run.mcap
        cellwright plot run.mcap
        cellwright plot run.mcap --panels score,trays --out score.pdf

    A recording that was cut short is plotted as far as it goes.

    Exit status: 0 done; 1 the figure could not be written; 2 bad input.
    """
    from cellwright.recording.format.reader import RecordingFile
    from cellwright.recording.plots.figure import FIGURE_SUFFIXES, PANELS, draw_figure, write_figure
    from cellwright.recording.plots.reading.plot_data import load_plot_data

    names = PANELS if panels is None else map(str.strip, panels.split(","))
    chosen = [options.one_of("--panels", "panel", name, PANELS) for name in names]
    path = Path(f"{file.stem}-plot.png") if out is None else out  # in the working folder
    suffix = path.suffix.lower()
    if suffix not in FIGURE_SUFFIXES:
        known = f"{', '.join(FIGURE_SUFFIXES[:-1])} or {FIGURE_SUFFIXES[-1]}"
        options.refuse(f"--out {path}: give a file whose name ends in {known}")
    options.output_file("--out", path, suffix)
    with RecordingFile(file) as opened:
        data = load_plot_data(opened)
    if data.warning:
        output.warn(data.warning)
    figure = draw_figure(data, chosen)
    try:
        write_figure(figure, path)
    except OSError as error:
        output.echo(f"{path}: cannot be written: {error.strerror or error}", err=True)
        raise typer.Exit(NOT_DONE) from None
    output.echo(f"figure      {path}")
    raise typer.Exit(DONE)
