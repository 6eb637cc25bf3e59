"""Command `cellwright eval merge`: the results of several machines as one evaluation."""

from pathlib import Path
from typing import Annotated

from rich.console import Console

from cellwright.cli.arguments import OUTPUT, AsJson
from cellwright.cli.eval.conclusion import AsTable, Reports, conclude, refuse_file, require_table, threshold_of
from cellwright.cli.output import print_line
from cellwright.cli.parameters import argument, option
from cellwright.running.evaluation.results import merge as merging

_MAX_NAMES = 10


def merge(
    folders: Annotated[list[Path], argument("FOLDER", "Folders of `cellwright eval --shard`.")],
    min_score: Annotated[str | None, option("SCORE", "As for `cellwright eval`.", OUTPUT)] = None,
    out: Annotated[Path, option("FOLDER", "Folder for the whole evaluation.", OUTPUT)] = Path("evaluation"),
    as_table: AsTable = False,
    as_json: AsJson = False,
) -> None:
    """Merge the shards of an evaluation.

    The files are those of one machine that does all runs. Results of shards that come later are added to FOLDER by the
    same command. Of a run that was done twice the first result counts.

        cellwright eval merge shards/* --out evaluation --min-score 75%

    Exit status: as for `cellwright eval`; 75 if runs are missing.
    """
    threshold = threshold_of(min_score)
    require_table(as_table)
    console = Console(stderr=as_json, highlight=False)
    try:
        merged = merging.merge(folders, out)
    except OSError as error:
        refuse_file(f"{error.filename}: {error.strerror or error}", error)
    for notice in merged.notices:
        print_line(console, f"warning: {notice}")
    for name in merged.differing:
        print_line(console, f"warning: {name}: its results differ, and the first counts; is the program repeatable?")
    failures = []
    if merged.missing:
        names = ", ".join(merged.missing[:_MAX_NAMES])
        more = len(merged.missing) - _MAX_NAMES
        failures.append(f"no result of {names}{f' and {more} more' if more > 0 else ''}; repeat their shards")
    conclude(merged.results, failures, Reports(out, threshold, as_table, as_json), console)
