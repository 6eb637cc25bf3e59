"""Readers of command line values, which refuse invalid ones before anything starts.

An invalid value raises a UsageError, or another CellwrightError of its reader, here and in all commands.
"""

import math
import os
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from fractions import Fraction
from pathlib import Path
from typing import NoReturn, TypeVar

from cellwright.cell.kitting.scorer import Averages, OrderScore, trial_score
from cellwright.cli import output
from cellwright.clients.client.session import parse_address
from cellwright.config.parsing.overrides import Override
from cellwright.config.parsing.tree import Problem
from cellwright.config.trial.catalogue import all_bundled, find_trial
from cellwright.config.trial.gear2017 import Loaded, load_trial
from cellwright.config.trial.joining import find_files, refuse_several_trials
from cellwright.config.trial.trial import Trial
from cellwright.rendering.views import Viewpoint, camera_of, cameras, viewpoint
from cellwright.util.errors import UnknownNameError, UsageError

XACRO_MARK = ":="
"""Mark between the name and the value of an argument of a xacro file."""

LATEST = 1e9
"""Latest time at which a run may stop [s]."""

MIN_RATE, MAX_RATE = 100, 10_000
"""Bounds of the physics rate of a robot controller node [Hz]: it publishes joint states a hundred times a second."""

MAX_SEED = 2**63 - 1
"""The same as in a trial's file."""

ABOVE_0, FINITE = math.ulp(0.0), sys.float_info.max
"""Bounds of `in_range`: the smallest number above 0, and the largest that is finite."""

N = TypeVar("N", float, int, Fraction, float | None, int | None)
P = TypeVar("P", Path, Path | None)
S = TypeVar("S", bound=str)
SPEED = "CELLWRIGHT_SPEED"
"""Environment variable: real-time factor of a served cell, for launch files, which cannot pass an option."""


def refuse(message: str) -> NoReturn:
    """Raise a UsageError that says why the input is not valid."""
    raise UsageError(message)


@contextmanager
def errors_of(option: str) -> Iterator[None]:
    """Prefix errors in the input with the option that they come from, such as `--camera`."""
    try:
        yield
    except UnknownNameError as error:
        refuse(f"{option}: {error.sentence()}")
    except UsageError as error:
        refuse(f"{option} {error}")


def one_of(option: str, kind: str, name: str, known: Sequence[S]) -> S:
    """Return the known name that equals `name`; `kind` is the word for such names in the error."""
    for each in known:
        if each == name:
            return each
    refuse(f"{option}: {UnknownNameError(kind, name, known).sentence()}")


def in_range(option: str, value: N, low: float, high: float, remedy: str, text: str | None = None) -> N:
    """Return a number within bounds, both included; None for None. The error has a remedy, and shows `text`."""
    if value is not None and not low <= value <= high:
        shown = text if text is not None else value if isinstance(value, int) else f"{value:g}"
        refuse(f"{option} {shown}: give {remedy}")
    return value


def paths(files: Sequence[str]) -> list[Path]:
    """Return the paths of a trial's files: of one name, of names joined by `+`, or of several that are joined.

    Raises:
        UsageError: there is no such file, or two names could be two trials.
    """
    found = [find_files(file, _path) for file in files]
    if len(files) > 1:
        refuse_several_trials(files, found)
    return [path for each in found for path in each]


def _similar_file(path: Path) -> str:
    """Return a hint about a file in the same folder, of a kind that trials have, with a similar name."""
    try:
        beside = {each.stem: each for each in path.parent.iterdir() if each.suffix in (".yaml", ".yml")}
    except OSError:
        return ""
    return "".join(f"; did you mean {beside[stem]}" for stem in get_close_matches(path.stem, beside, n=1))


def _path(file: str) -> Path:
    path = Path(file)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.suffix or path.name != file:  # not the name of a trial
            refuse(f"{file}: there is no such file{_similar_file(path)}")
        return find_trial(file)
    except OSError as error:
        refuse(f"{file}: cannot be read: {error.strerror}")
    if not stat.S_ISDIR(mode):
        return path
    if file in all_bundled():
        return find_trial(file)
    refuse(f"{file}: is a folder; give the files of a trial")


def xacro_arguments(words: Sequence[str] | None) -> dict[str, str]:
    """Read the arguments of a xacro file, each `NAME:=VALUE`; the last of a name counts."""
    found = {}
    for word in words or ():
        name, mark, value = word.partition(XACRO_MARK)
        if not mark or not name.isidentifier():
            refuse(f"{word}: give arguments of a xacro file as NAME:=VALUE")
        found[name] = value
    return found


def overrides(texts: Sequence[str] | None) -> list[Override]:
    """Read the values of `--set`."""
    return [Override.read(text, "--set") for text in texts or ()]


def load(files: Sequence[str], overrides: Sequence[Override] = ()) -> Trial:
    """Read the trial in these files; warnings are printed on stderr."""
    return load_variants(files, [overrides])[0].trial


def load_variants(files: Sequence[str], variants: Iterable[Sequence[Override]]) -> list[Loaded]:
    """Read the trial in these files with each sequence of overrides; warnings are printed on stderr, once each."""
    loaded = [load_trial(paths(files), overrides=overrides) for overrides in variants]
    found: list[Problem] = []
    if any(each.places for each in loaded):
        from cellwright.cell.checks.findings import cell_warnings  # slow to load

        found = [warning for each in loaded for warning in cell_warnings(each.trial, each.places)]
    for warning in dict.fromkeys((*(warning for each in loaded for warning in each.warnings), *found)):
        output.warn(warning)
    return loaded


def timed_file(option: str, text: str, suffix: str) -> tuple[Fraction, Path]:
    """Read `T:FILE`: a simulation time [s] and a writable file with the right suffix."""
    time, _, file = text.partition(":")
    when, path = _number(time), Path(file)
    if not 0 <= when <= LATEST or path.suffix.lower() != suffix:
        refuse(f"{option} {text}: give a time in seconds and a file, such as 12.5:cell{suffix}")
    _check_file(f"{option} {text}", path)
    return Fraction(str(when)), path


def output_file(option: str, path: P, suffix: str) -> P:
    """Return the path of a writable file with the right suffix; None for None."""
    if path is None:
        return path
    if path.suffix.lower() != suffix:
        refuse(f"{option} {path}: give a file whose name ends in {suffix}")
    _check_file(f"{option} {path}", path)
    return path


def _check_file(place: str, path: Path) -> None:
    """Refuse a file that is not writable."""
    try:
        if not path.parent.is_dir():
            refuse(f"{place}: there is no folder {path.parent}")
        if path.is_dir():
            refuse(f"{place}: {path} is a folder")
        is_there = path.exists()
    except OSError as error:  # the name is too long, or the folder is not readable
        refuse(f"{place}: {error.strerror}")
    if not os.access(path if is_there else path.parent, os.W_OK):
        refuse(f"{place}: {path} cannot be written")


def writable_file(option: str, path: Path) -> None:
    """Refuse a file that cannot be written."""
    _check_file(f"{option} {path}", path)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def default_speed(variables: Mapping[str, str]) -> float | None:
    """Return the real-time factor without an option: that of the environment, or 1."""
    return speed(variables.get(SPEED, "1"), SPEED)


def speed(text: str, name: str = "--speed") -> float | None:
    """Return the real-time factor; None for `max`."""
    if text == "max":
        return None
    return in_range(name, _number(text), ABOVE_0, FINITE, "a factor above 0, such as 1 for real time, or max", text)


def physics_rate(text: str) -> Fraction:
    """Return the physics rate [Hz]; a fraction such as 1000/3 stays exact."""
    try:
        value = Fraction(text)
    except (ValueError, ZeroDivisionError):
        value = Fraction(0)
    remedy = f"a rate from {MIN_RATE} to {MAX_RATE} Hz, such as 240"
    return in_range("--rate", value, MIN_RATE, MAX_RATE, remedy, text)


def joint_speed(text: str) -> tuple[str, float]:
    """Read `PATTERN=SPEED`: a pattern of joint names and a speed [rad/s; m/s]; a speed alone is for all joints."""
    pattern, _, value = text.rpartition("=")
    remedy = "a speed above 0, such as 1.5, or J_arm_*=1.5 for some joints"
    return pattern or "*", in_range("--max-speed", _number(value), ABOVE_0, FINITE, remedy, text)


def until(value: float | None) -> float | None:
    """Return a valid time to stop at [s]."""
    return in_range("--until", value, ABOVE_0, LATEST, f"a time above 0 s and up to {LATEST:g} s")


def averages(text: str | None, trial: Trial) -> Averages | None:
    """Read `COST,TIME`: the averages of all teams on this trial, with a time for each order."""
    if text is None:
        return None
    cost, *times = map(_number, text.split(","))
    given = Averages(cost, tuple(times))
    with errors_of(f"--averages {text}:"):
        trial_score(trial.sensors, [OrderScore(order.order_id) for order in trial.orders], given)
    return given


def address(option: str, text: str) -> tuple[str, int]:
    """Read host and port from `HOST:PORT`."""
    with errors_of(option):
        return parse_address(text)


def camera(text: str) -> Viewpoint:
    """Return the camera of numbers; the name of a view is known once the cell is."""
    with errors_of("--camera"):
        return viewpoint(text)


def check_views(trial: Trial, viewpoints: Mapping[str, Viewpoint | None]) -> None:
    """Refuse the name of a view that the cell of a trial has not, with the option that names it."""
    for option, each in viewpoints.items():
        if each is not None:
            with errors_of(option):
                camera_of(each, cameras(trial.layout))
