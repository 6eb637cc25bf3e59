"""Check of configuration files, with a report for people and for programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cellwright.config.parsing.overrides import Override
from cellwright.config.parsing.tree import Place
from cellwright.config.robot.groups import robot_document
from cellwright.config.robot.robots import is_robot_file, load_robot
from cellwright.config.robot.urdf_file import NO_ARGUMENTS, Arguments
from cellwright.config.trial.gear2017 import load_trial, resolved, resolved_cell
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError, UsageError


@dataclass(frozen=True, slots=True)
class Report:
    """Result of a check; errors and warnings read `path:line: key: what is wrong`.

    Attributes:
        errors: faults that make the files unusable, in the order of files and lines.
        warnings: further findings for the files' author.
        resolved: the trial or robot as JSON-able data; None after errors.
        trial: the trial; None for a robot or after errors.
        places: places of the entries of a cell of one's own, by their dotted path.
    """

    errors: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    resolved: dict[str, Any] | None = None
    trial: Trial | None = None
    places: Mapping[str, Place] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """True if the files can be used."""
        return not self.errors

    def lines(self) -> list[str]:
        """Return the report for people: errors, warnings, and the verdict last."""
        count = len(self.errors)
        verdict = "ok" if self.ok else f"{count} error{'' if count == 1 else 's'}"
        return [*(f"error: {text}" for text in self.errors), *(f"warning: {text}" for text in self.warnings), verdict]

    def as_dict(self) -> dict[str, Any]:
        """Return the report for programs, as JSON-able data."""
        return {"ok": self.ok, "errors": list(self.errors), "warnings": list(self.warnings), "resolved": self.resolved}


def check(paths: Sequence[Path], overrides: Sequence[Override] = (), arguments: Arguments = NO_ARGUMENTS) -> Report:
    """Load the files as one trial, or the one file as a robot, and return a report.

    Args:
        paths: files of a trial, whose texts are joined; or one file that describes a robot.
        overrides: values that replace those of the trial's files.
        arguments: arguments of a robot's xacro file, by name.

    Raises:
        UsageError: overrides of a robot's file, or arguments for a trial's.

    Example:
        >>> from cellwright.config.trial.catalogue import find_trial
        >>> report = check([find_trial("lesson")])
        >>> report.ok, report.lines()
        (True, ['ok'])
    """
    if len(paths) == 1 and is_robot_file(paths[0]):
        if overrides:
            raise UsageError(f"{overrides[0].option}: {paths[0]} is a robot's; give the files of a trial")
        return _check_robot(paths[0], arguments)
    for name, value in arguments.items():
        raise UsageError(f"{name}:={value}: only a robot's xacro file has arguments")
    try:
        loaded = load_trial(paths, overrides=overrides)
    except DescriptionError as error:
        return Report(errors=tuple(map(str, error.problems)), warnings=tuple(map(str, error.warnings)))
    found = {**resolved(loaded), **resolved_cell(loaded.trial)}
    return Report(warnings=tuple(map(str, loaded.warnings)), resolved=found, trial=loaded.trial, places=loaded.places)


def _check_robot(path: Path, arguments: Arguments) -> Report:
    warnings: list[str] = []
    try:
        config = load_robot(path, warnings.append, arguments)
    except DescriptionError as error:
        found = tuple(dict.fromkeys((*warnings, *map(str, error.warnings))))
        return Report(errors=tuple(map(str, error.problems)), warnings=found)
    return Report(warnings=tuple(warnings), resolved=robot_document(config))
