"""Command `cellwright cell schema`: the JSON Schema of a trial's file."""

import json

import typer

from cellwright.config.trial.schema import trial_schema


def schema() -> None:
    """Print the JSON Schema of the files of trials and cells, for editors.

    An editor that knows the schema completes entries, explains them, and marks mistakes while you write:

        cellwright cell schema > cellwright.schema.json

    The first line of a file then names it, for editors with the YAML language server:

        # yaml-language-server: $schema=cellwright.schema.json

    `cellwright check` finds more: names that refer to nothing, values that do not fit together.
    """
    typer.echo(json.dumps(trial_schema(), indent=2, ensure_ascii=False))
