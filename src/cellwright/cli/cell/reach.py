"""Command `cellwright cell reach`: what each arm of a cell reaches, place by place."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cellwright.cell.checks.clearance import PlaceReach, State, place_reaches
from cellwright.cell.checks.reach import CLEARANCE
from cellwright.cell.checks.surfaces import SPACING, surfaces_in
from cellwright.cli import options
from cellwright.cli.arguments import Files, Overrides
from cellwright.cli.output import progress_bar
from cellwright.cli.parameters import flag, option
from cellwright.cli.tables import FOLD, RIGHT, print_table, table
from cellwright.config.trial.trial import Trial

_SIGNS = {State.OUT: ".", State.BLOCKED: "o", State.CLEAR: "#"}


def reach(
    files: Files,
    overrides: Overrides = None,
    picture: Annotated[Path | None, option("FILE", "Draw the reach on a map, as a .png or .svg file.")] = None,
    as_json: Annotated[bool, flag("--json", "Print the shares, margins and points as JSON.")] = False,
) -> None:
    """Show what each arm of a cell reaches with its tool pointing down: of each bin, belt, AGV and tray.

    Points are 5 cm apart. The tool is 2 cm over them, with any yaw, from any place of a rail. `in reach` is the share
    for which the arm has a posture. At a `clear` point it touches nothing, but for its hand the place itself. Parts are
    left out.

    Margins are the smallest over all clear points, in the posture that has most room. `singular` is the smallest
    singular value. At v m/s of the tool a joint turns at v / singular rad/s at most. `limit` is the distance to the
    nearest limit of a joint, in rad, or in m of a sliding one.

    With `--json`: for each arm and place the same figures, and under `points` a line for each row along the y axis of
    the place: `#` clear, `o` in reach, `.` out of reach.
    """
    if picture is not None:
        options.writable_file("--picture", picture)
        from cellwright.viewer.cell_map import check_suffix  # slow to load

        check_suffix(picture)
    trial = options.load(files, options.overrides(overrides))
    if not trial.arms:
        options.refuse(f"{trial.name}: the cell has no arm; add the section `arm`, or a file that has it")
    found = _measured(trial, Console(stderr=as_json, highlight=False))
    if picture is not None:
        from cellwright.viewer.cell_map import draw_map

        draw_map(trial, picture, found)
    if as_json:
        typer.echo(json.dumps(_document(trial, found), indent=2))
    else:
        _show(found)


def _measured(trial: Trial, console: Console) -> list[PlaceReach]:
    found = []
    with progress_bar(console, "reach", len(trial.arms) * len(surfaces_in(trial))) as show:
        for each in place_reaches(trial):
            found.append(each)
            if show is not None:
                show(len(found), f"{each.arm}, {each.surface.name}")
    return found


def _show(found: Sequence[PlaceReach]) -> None:
    columns = {
        "arm": FOLD,
        "place": FOLD,
        "in reach": RIGHT,
        "clear": RIGHT,
        "singular [m]": RIGHT,
        "limit [rad]": RIGHT,
    }
    rows = [
        (
            each.arm,
            each.surface.name,
            _percent(each.reached),
            _percent(each.clear),
            *(("-", "-") if each.worst is None else (f"{each.worst.singular:.3f}", f"{each.worst.limit:.2f}")),
        )
        for each in found
    ]
    print_table(Console(highlight=False), table(columns, rows))


def _percent(share: float) -> str:
    """Return a share in percent; 0 and 100 % only if it is nothing and all."""
    return f"{round(100 * share) if share in (0.0, 1.0) else min(99, max(1, round(100 * share)))} %"


def _document(trial: Trial, found: Sequence[PlaceReach]) -> dict[str, Any]:
    arms: dict[str, dict[str, Any]] = {arm.name: {} for arm in trial.arms}
    for each in found:
        arms[each.arm][each.surface.name] = {
            "kind": each.surface.section,
            "in_reach": each.reached,
            "clear": each.clear,
            "singular": each.worst and each.worst.singular,
            "limit": None if each.worst is None or math.isinf(each.worst.limit) else each.worst.limit,
            "points": ["".join(_SIGNS[State(state)] for state in row) for row in each.states.tolist()],
        }
    return {"trial": trial.name, "spacing": SPACING, "height": CLEARANCE, "arms": arms}
