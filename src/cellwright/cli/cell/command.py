"""Command group `cellwright cell`."""

import typer

from cellwright.cli.cell.schema import schema

app = typer.Typer(
    name="cell",
    help="""Write the file of a cell or a trial.

    An editor that has the schema completes and explains entries; `cellwright check` judges the whole file:

        cellwright cell schema > cellwright.schema.json  # for editors
        cellwright check mine.yaml                       # errors and warnings""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)


@app.callback()
def _group() -> None:
    pass


app.command()(schema)
