"""Command group `cellwright cell`."""

import typer

from cellwright.cli.cell.export import export
from cellwright.cli.cell.new import new
from cellwright.cli.cell.reach import reach
from cellwright.cli.cell.schema import schema

app = typer.Typer(
    name="cell",
    help="""Write the file of a cell or a trial, see what its arms reach, and export it for other programs.

    Begin with `cellwright cell new mine.yaml`. An editor that has the schema completes and explains entries.
    `cellwright check mine.yaml --map mine.svg` judges the whole file, and draws the cell.""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)

for command in (new, schema, reach, export):
    app.command()(command)
