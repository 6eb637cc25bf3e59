"""Trials, robots and recordings by their names: what a program loads, and the target of a session for each."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from cellwright.cell.cell import Cell
from cellwright.cell.checks.findings import cell_warnings
from cellwright.config.parsing.overrides import Override
from cellwright.config.robot import robots
from cellwright.config.robot.config import RobotConfig
from cellwright.config.trial import gear2017
from cellwright.config.trial.catalogue import bundled as bundled_trials
from cellwright.config.trial.joining import TrialName, find_files
from cellwright.config.trial.trial import Trial
from cellwright.running.run.cells import CellTarget
from cellwright.running.run.target import Target
from cellwright.util.errors import CellwrightError, UsageError

if TYPE_CHECKING:
    from cellwright.robot.node import RobotNode

RECORDINGS = (".mcap", ".bag")
"""Suffixes of recordings."""

AnyTarget: TypeAlias = "TrialName | Trial | Cell | RobotConfig | RobotNode | Target"
"""Target of a session, or a value or name that one is made of."""


class DescriptionWarning(UserWarning):
    """A warning for a file's author that stops nothing, as `path:line: key: message`."""


def load_trial(*sources: TrialName, text: str | None = None, overrides: Sequence[str] = ()) -> Trial:
    """Load a trial by its name or its files, or from a text. Notes for its author come as `DescriptionWarning`.

    Example:
        >>> import cellwright
        >>> cellwright.load_trial("lesson").name
        'lesson'
        >>> cellwright.load_trial("final01+kitter_sensors").has_arm
        True
        >>> cellwright.load_trial(text="time_limit: 60").time_limit
        60.0
        >>> cellwright.load_trial("lesson", overrides=["time_limit=60"]).time_limit
        60.0

    Args:
        sources: a bundled trial (`"lesson"`) or the path of a YAML file; several are joined, as are those of one name
            with `+` (`"final01+kitter_sensors"`) and of a list.
        text: the configuration itself, instead.
        overrides: values that replace those of the files, as `KEY=VALUE`: the key as errors and warnings print it, and
            the value as YAML.

    Raises:
        UnknownNameError: there is no such trial or file.
        DescriptionError: the configuration is not valid, or the trial would ignore an override; the error lists
            everything that is wrong.
        UsageError: there is neither a name nor a text, or both; or an override is not KEY=VALUE.
    """
    loaded = gear2017.load_trial(
        [file for source in sources for file in find_files(source)],
        text=text,
        overrides=list(map(Override.read, overrides)),
    )
    warn_of((*loaded.warnings, *cell_warnings(loaded.trial, loaded.places)), 3)
    return loaded.trial


def load_robot(name_or_path: str | Path, *, xacro_arguments: Mapping[str, str] | None = None) -> RobotConfig:
    """Load a robot by its name or its file. Notes for the file's author come as `DescriptionWarning`.

    Example:
        >>> import cellwright
        >>> cellwright.load_robot("tandem").name
        'tandem'

    Args:
        name_or_path: a bundled robot (`"tandem"`), a `vr_configs.yml`, a folder with one, or a URDF, xacro or MJCF.
        xacro_arguments: arguments of the xacro file, by name; they replace those of a configuration.

    Raises:
        UnknownNameError: there is no robot of this name.
        DescriptionError: the files are not valid; the error lists everything that is wrong.
    """
    lines: list[str] = []
    config = robots.load_robot(name_or_path, lines.append, xacro_arguments or {})
    warn_of(lines, 3)
    return config


def warn_of(lines: Iterable[object], level: int) -> None:
    """Issue the lines as warnings of the caller `level` calls up."""
    for line in lines:
        warnings.warn(str(line), DescriptionWarning, stacklevel=level)


def target_of(target: AnyTarget, *, seed: int | None = None, is_real_time: bool = False) -> Target:
    """Return the target for a session.

    Raises:
        UnknownNameError: there is no such trial, robot or file.
        UsageError: a trial and a robot share the name.
    """
    if isinstance(target, Target):
        return target
    if isinstance(target, Cell):
        return CellTarget(lambda: target)
    if isinstance(target, Trial):
        return CellTarget(lambda: Cell(target, seed=seed))
    if isinstance(target, Sequence) and not isinstance(target, str):
        return CellTarget(lambda: Cell(load_trial(target), seed=seed), lambda: find_files(target))
    if isinstance(target, str | Path):
        if Path(target).suffix.lower() in RECORDINGS:
            from cellwright.running.run.playback import PlaybackTarget

            return PlaybackTarget(Path(target))
        if not is_robot(target):
            return CellTarget(lambda: Cell(load_trial(target), seed=seed), lambda: find_files(target))
    from cellwright.running.run.robots import RobotTarget

    if isinstance(target, str | Path):
        return RobotTarget.of(lambda: load_robot(target), is_real_time=is_real_time)
    return RobotTarget.of(target, is_real_time=is_real_time)


def is_robot(word: str | Path) -> bool:
    """Return whether a name or a path is that of a robot; a name of neither counts as a trial's.

    Raises:
        UsageError: a trial has this name as well.
    """
    if word in robots.bundled():
        if word in bundled_trials():
            raise UsageError(f"{word}: names both a trial and a robot; give the path of a file")
        return True
    with suppress(CellwrightError, OSError, ValueError):  # loading it reports the errors
        return Path(word).is_dir() or robots.is_robot_file(robots.find_robot(word))
    return False
