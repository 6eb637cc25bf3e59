"""Command `cellwright eval compare`: the difference between two evaluations, and the verdict on the second."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from cellwright.cli import options
from cellwright.cli.arguments import AsJson
from cellwright.cli.main import DONE, INCONCLUSIVE, NOT_DONE
from cellwright.cli.output import print_entry, print_line
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.running.evaluation.results.comparison import Comparison, Pair, read_evaluation
from cellwright.running.evaluation.results.measures import MEASURES, Change
from cellwright.running.evaluation.results.power import Power
from cellwright.running.evaluation.results.summary import range_text, with_interval
from cellwright.running.evaluation.results.verdict import MAX_PAIRS, Verdict

_MAX_TURNED = 10


def compare(
    before: Annotated[str, argument("A", "Folder of the first evaluation, or its `summary.json`.")],
    after: Annotated[str, argument("B", "Folder of the second evaluation, such as that of your new version.")],
    margin: Annotated[
        float, option("P", "Loss that is accepted [% of the attainable points, and of the runs done].", "Comparison")
    ] = 0.0,
    strict: Annotated[bool, flag("--strict", "Take an inconclusive verdict for a regression.", "Comparison")] = False,
    as_json: AsJson = False,
) -> None:
    """Compare two evaluations, paired by trial and seed: the difference, its interval, and the runs that turned.

    Both are folders of `cellwright eval`, with two programs or two versions of one. B is a regression if exact tests
    show that it loses more than --margin, in points or in runs that are done. It is none if no run loses more than
    that, or if they show so. Else the verdict is inconclusive, with the number of seeds that would tell.

        cellwright eval lesson --vary --seeds 10 --agent old.py:MyRobot --out old
        cellwright eval lesson --vary --seeds 10 --agent new.py:MyRobot --out new
        cellwright eval compare old new --margin 2

    Exit status: 0 no regression; 1 a regression; 2 bad input; 3 inconclusive (1 with --strict).
    """
    options.in_range("--margin", margin, 0.0, 100.0, "a number from 0 to 100")
    found = Comparison.of(read_evaluation(Path(before)), read_evaluation(Path(after)))
    document = found.as_json(margin / 100.0)
    if as_json:
        typer.echo(json.dumps(document, indent=2))
    else:
        _show(found, document, (before, after), margin)
    raise typer.Exit(_status(Verdict(document["verdict"]), strict=strict))


def _status(verdict: Verdict, *, strict: bool) -> int:
    if verdict is Verdict.INCONCLUSIVE:
        return NOT_DONE if strict else INCONCLUSIVE
    return NOT_DONE if verdict is Verdict.WORSE else DONE


def _show(found: Comparison, document: dict[str, Any], names: tuple[str, str], margin: float) -> None:
    console = Console(highlight=False)
    for side in (0, 1):
        share = f"{document['shares'][side]:.1%} of the attainable points"
        words = with_interval(share, document["share_intervals"][side])
        done = f"{document['done'][side]} of {len(found.pairs)} runs done"
        done = with_interval(done, document["done_intervals"][side])
        print_entry(console, "AB"[side], f"{names[side]}, agent {document['agents'][side]}: {words}, {done}")
    console.print()
    figures = dict.fromkeys(("pairs", "A", "B", "B - A", "95 %", "better", "worse"), RIGHT)
    rows: list[list[str | Text]] = []
    for each in found.trials():
        means = [f"{each.before:.4g}", f"{each.after:.4g}", f"{each.difference:+.3g}", range_text(each.interval)]
        rows.append([each.trial, str(each.pairs), *means, str(each.better), str(each.worse)])
    print_table(console, table({"trial": FOLD, **figures}, rows))
    measured: list[list[str | Text]] = [
        [each.trial, measure.label, *_measured(each.measures[measure.name], measure.scale)]
        for each in found.trials()
        for measure in MEASURES
        if measure.name in each.measures
    ]
    if measured:
        console.print()
        figures = dict.fromkeys(("pairs", "A", "B", "B - A", "95 %"), RIGHT)
        print_table(console, table({"trial": FOLD, "figure": WHOLE, **figures}, measured))
    if power := found.power():
        console.print()
        print_table(console, _power_table(power))
        print_entry(console, "visible", "in 80 % of experiments with this number of seeds, at a level of 5 %")
        if needed := [f"{each.needed} for {name}" for name, each in power.items() if each.needed is not None]:
            print_entry(console, "needed", f"seeds to show B - A as it was seen: {', '.join(needed)}")
    turned = found.turned
    for pair in turned[:_MAX_TURNED]:
        print_line(console, f"  {_turn(pair)}")
    if len(turned) > _MAX_TURNED:
        console.print(f"  and {len(turned) - _MAX_TURNED} more")
    if any(found.unpaired):
        print_entry(console, "unpaired", f"{found.unpaired[0]} runs of A, {found.unpaired[1]} of B")
    difference = f"{found.difference * 100.0:+.3g} % of the attainable points"
    print_entry(console, "difference", with_interval(difference, found.interval))
    for question, chance in document["chances"].items():
        if chance is not None:
            print_entry(console, "chance", f"{chance:.2g} of such a loss of {question}, if B loses {_beyond(margin)}")
    print_entry(console, "verdict", _verdict_words(document, margin))


def _power_table(power: Mapping[str, Power]) -> FittedTable:
    """Return a table of the smallest differences that numbers of seeds show."""
    numbers = next(iter(power.values())).visible
    rows = [[str(number), *(_percent(each.visible[number]) for each in power.values())] for number in numbers]
    return table(dict.fromkeys(["seeds", *power], RIGHT), rows)


def _percent(share: float | None) -> str:
    """Return a difference of two shares; a dash for none that is possible."""
    return "-" if share is None or share > 1.0 else f"{100.0 * share:.3g} %"


def _beyond(margin: float) -> str:
    return f"{margin:g} %" if margin else "nothing"


def _verdict_words(document: dict[str, Any], margin: float) -> str:
    """Return the verdict in words, with what would help."""
    verdict = Verdict(document["verdict"])
    if verdict is Verdict.INCONCLUSIVE:
        seeds = document["more_seeds"]
        enough = f"more than {MAX_PAIRS} pairs" if seeds is None else f"{seeds} more seed{'s' if seeds > 1 else ''}"
        return f"inconclusive: a loss of more than {margin:g} % may be chance or not; about {enough} would tell"
    if verdict is Verdict.WORSE:
        return f"worse: B loses more than {margin:g} %"
    return "better: B gains" if verdict is Verdict.BETTER else f"not worse: B loses no more than {margin:g} %"


def _measured(change: Change, scale: float) -> list[str]:
    means = [f"{change.before * scale:.3g}", f"{change.after * scale:.3g}", f"{change.difference * scale:+.3g}"]
    return [str(change.pairs), *means, range_text(change.interval, scale)]


def _turn(pair: Pair) -> str:
    before, after = pair.before, pair.after
    points = f"{before.name}: {before.points:g} -> {after.points:g} of {after.reachable:g} points"
    if before.outcome == after.outcome:
        return points
    reason = f" ({after.reason})" if after.reason else ""
    return f"{points}, {before.outcome.replace('_', ' ')} -> {after.outcome.replace('_', ' ')}{reason}"
