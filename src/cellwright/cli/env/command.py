"""Command group `cellwright env`."""

import typer

from cellwright.cli.env.serve import serve

app = typer.Typer(
    name="env",
    help="""Learn on cells: environments of tasks, for programs in other processes.

    Begin with `cellwright env serve pick_from_bin`. Python programs of one environment with Cellwright need no server:
    they call `gymnasium.make("cellwright.envs:PickFromBin-v0")`.""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)


@app.callback()
def _group() -> None:
    """Keep the name of the only command."""


app.command()(serve)
