"""Making a cell or a robot again from what a recording carries, to stand where the recording begins."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar, get_args

from cellwright.cell import variation
from cellwright.cell.cell import Cell
from cellwright.config.robot.robots import load_robot
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import ServoProfile
from cellwright.engine.snapshot import read_checkpoint
from cellwright.recording.format.reader import Recording
from cellwright.recording.replay.rebuilt import Rebuilt, Stamps
from cellwright.recording.replay.unpacked import inside, unpacked
from cellwright.robot.node import RobotNode
from cellwright.robot.safety.settings import Guard, SafetySettings
from cellwright.robot.services import RobotServices
from cellwright.robot.servos import Motion
from cellwright.util.errors import RecordingError

_PACKAGES = "ROS_PACKAGE_PATH"
_MOST_TIMES = 10_000
T = TypeVar("T")


@contextmanager
def rebuild(recording: Recording) -> Iterator[Rebuilt]:
    """What was recorded, made again; it is let go of afterwards.

    Raises:
        RecordingError: the recording does not say what it was, or it was something that cannot be run again.
        CellwrightError: what it was read from cannot be used here, such as a sensor of a package that is missing.
    """
    with unpacked(recording.sources) as folder:
        rebuilt = _robot(recording, folder) if recording.header.kind == "robot" else _cell(recording, folder)
        try:
            yield rebuilt
        finally:
            rebuilt.close()


def _cell(recording: Recording, folder: Path) -> Rebuilt:
    facts = _Facts(recording.header.facts)
    with _packages(folder, facts):
        trial = load_trial(_files(folder, facts)).trial
    seed = facts.of("seed", int)
    if facts.of("varied", bool):
        trial = variation.vary(trial, seed)
    cell = Cell(trial, seed=seed, servo=_servo(facts), competition=facts.of("competition", bool))
    for when in facts.times("checkpoints"):
        cell.checkpoints.declare(when, None)
    cell.reset()
    if recording.start is not None:
        start = folder / "start.npz"
        start.write_bytes(recording.start)
        read_checkpoint(cell.simulation, start)
    return Rebuilt(cell, close=cell.simulation.close)


def _robot(recording: Recording, folder: Path) -> Rebuilt:
    facts = _Facts(recording.header.facts)
    if facts.of("driver", bool):
        raise RecordingError("a driver moved this robot, and no simulation: what it did cannot be run again")
    with _packages(folder, facts):
        config = load_robot(_files(folder, facts)[0], _nothing)
    stamps = Stamps()
    node = RobotNode(
        config,
        motion=facts.read("motion", Motion),
        timestep=facts.read("timestep", lambda told: Fraction(*told)),
        self_collision=facts.of("self_collision", bool),
        safety=facts.read("safety", _safety),
        node=facts.of("node", str),
        sim_time=facts.of("sim_time", bool),
        stamp=stamps,
    )
    collected = _Collected()
    RobotServices(node).offer(collected)
    return Rebuilt(node, stamps, collected.found, node.close)


class _Facts:
    """What a header says, which may come from anywhere."""

    def __init__(self, facts: Mapping[str, Any]) -> None:
        self._facts = facts

    def of(self, key: str, kind: type[T]) -> T:
        """A value of a type."""
        value = self._facts.get(key)
        if type(value) is not kind:
            raise RecordingError(f"the recording does not say what is needed to run it again: {key} is {value!r:.40}")
        return value

    def read(self, key: str, reader: Callable[[Any], T]) -> T:
        """A value as something reads it."""
        value = self._facts.get(key)
        try:
            return reader(value)
        except (TypeError, ValueError, KeyError, ZeroDivisionError):
            raise RecordingError(
                f"the recording does not say what is needed to run it again: {key} is {value!r:.40}"
            ) from None

    def names(self, key: str) -> list[Any]:
        """Names of files."""
        value = self._facts.get(key)
        return value if isinstance(value, list) else []

    def times(self, key: str) -> list[int]:
        """Times [ns]."""
        found = [each for each in self.names(key)[:_MOST_TIMES] if type(each) is int and each >= 0]
        if found != self._facts.get(key):
            raise RecordingError(f"the recording does not say what is needed to run it again: {key} are no times")
        return found


class _Collected:
    """Takes services that act, in the place of a server."""

    def __init__(self) -> None:
        self.found: dict[str, Callable[[dict[str, Any]], object]] = {}

    def offer(self, service: str, handler: Callable[[dict[str, Any]], Any], *, acts: bool = False) -> None:
        if acts:
            self.found[service] = handler


def _files(folder: Path, facts: _Facts) -> list[Path]:
    found = [inside(folder, name) for name in facts.names("files")]
    if not found:
        raise RecordingError("the recording does not hold the files that it was made from: it cannot be run again")
    missing = [each.name for each in found if not each.is_file()]
    if missing:
        raise RecordingError(f"the recording does not hold {missing[0]}: it was cut short too early to be run again")
    return found


def _servo(facts: _Facts) -> ServoProfile:
    told = facts.of("servo", str)
    for profile in get_args(ServoProfile):
        if profile == told:
            found: ServoProfile = profile
            return found
    raise RecordingError(f"the recording tells of servos {told!r:.40}, which are not known here")


def _safety(told: Mapping[str, Any]) -> SafetySettings:
    speeds = tuple((str(pattern), float(speed)) for pattern, speed in told["max_speeds"])
    return SafetySettings(**{**told, "max_speeds": speeds, "guard": Guard(told["guard"])})


@contextmanager
def _packages(folder: Path, facts: _Facts) -> Iterator[None]:
    """Have packages of ROS looked for where the recording has them."""
    before = os.environ.get(_PACKAGES)
    places: Sequence[str] = [str(inside(folder, name)) for name in facts.names("packages")]
    os.environ[_PACKAGES] = os.pathsep.join(places)
    try:
        yield
    finally:
        if before is None:
            del os.environ[_PACKAGES]
        else:
            os.environ[_PACKAGES] = before


def _nothing(_line: str) -> None:
    pass
