"""Findings about a cell of one's own: what cannot work, with the reason."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cellwright.cell.checks.obstacles import blocked_paths, obstacles, overlaps
from cellwright.cell.checks.reach import reaches, share_out_of_reach
from cellwright.cell.checks.sight import blind_cameras
from cellwright.cell.checks.surfaces import surfaces_in
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.surfaces import Surface
from cellwright.config.parsing.findings import Finding
from cellwright.config.parsing.tree import Place, Problem
from cellwright.config.trial.trial import Trial

_NOTEWORTHY = 0.25
"""Share of a surface out of reach above which it is worth a warning: less is often meant, as with 2017's AGVs."""
_ALL = 0.99
"""Share from which all of a surface counts as out of reach."""


def findings(trial: Trial) -> tuple[Finding, ...]:
    """Return what cannot work in a trial's cell; what it shares with 2017's cell is accepted as it is.

    Keys of sensors begin with `sensors.`, also of those that the file has below `cell`.

    Example:
        >>> import cellwright
        >>> findings(cellwright.load_trial("lesson"))
        ()
    """
    found = surfaces_in(trial)
    return (*_reach(trial, found), *_ways(trial), *_cameras(trial, found))


def cell_warnings(trial: Trial, places: Mapping[str, Place]) -> tuple[Problem, ...]:
    """Return what cannot work in a trial's cell as warnings for its file's author.

    Args:
        trial: the trial.
        places: places of the entries of its file, as `Loaded` has them: without any, the cell is that of 2017.
    """
    return tuple(_in_file(each, places).at(places, "warning") for each in findings(trial)) if places else ()


def _in_file(finding: Finding, places: Mapping[str, Place]) -> Finding:
    """Return a finding with the key that the file has: a sensor may be described below `cell`."""
    in_cell = f"cell.{finding.key}"
    return Finding(in_cell, finding.message) if in_cell in places else finding


def _reach(trial: Trial, found: tuple[Surface, ...]) -> Iterator[Finding]:
    layout = trial.layout
    original = gear2017().moved(layout.frame)
    accepted = surfaces_in(Trial("", layout=original)) if layout.arms == original.arms else ()
    judged = [surface for surface in found if surface not in accepted] if trial.arms else []
    arms = reaches(trial) if judged else ()
    # a file is loaded in no time, and `cellwright cell reach` takes its time; an arm on another one gets about
    if not all(arm.is_quick for arm in arms) or any(arm.mount.on for arm in trial.arms):
        return
    whom = "the arm" if len(arms) == 1 else "all arms"
    for surface in judged:
        share = share_out_of_reach(surface, arms)
        if share > _NOTEWORTHY:
            part = "of its width is" if surface.is_belt else "is"
            much = "" if share > _ALL else f"{share:.0%} {part} "
            yield Finding(surface.key, f"{much}out of reach of {whom}, tool down; move it nearer")


def _ways(trial: Trial) -> Iterator[Finding]:
    found = obstacles(trial)
    for one, other, depth in overlaps(found):
        yield Finding(other.key, f"overlaps {one.name} by {depth:.2f} m; move one of them")
    for carrier, other, (x, y) in blocked_paths(trial, found):
        message = f"runs into {other.name} at [{x:.2f}, {y:.2f}]; lead the path around it, or move it"
        yield Finding(f"cell.carriers.{carrier.name}.path", message)


def _cameras(trial: Trial, found: tuple[Surface, ...]) -> Iterator[Finding]:
    for camera, reason in blind_cameras(trial, found):
        yield Finding(f"sensors.{camera.name}", reason)
