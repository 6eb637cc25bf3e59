"""Cell or robot rebuilt from the files and settings in a recording, ready to run again."""

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any, TypeVar, cast, get_args

from cellwright.cell.cell import Cell
from cellwright.cell.start import Start
from cellwright.cell.variation import Bounds
from cellwright.config.arm import ServoProfile
from cellwright.config.parsing.overrides import Override
from cellwright.config.robot.robots import load_robot
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.snapshot import read_checkpoint
from cellwright.recording.format.commands import Command, Extras
from cellwright.recording.format.reader import RecordingFile
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import Guard, SafetySettings
from cellwright.robot.services import RobotServices
from cellwright.robot.servos import Motion
from cellwright.util.errors import RecordingError
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation_requests import PREFIX, SPAWNED, TIME

_PACKAGES = "ROS_PACKAGE_PATH"
_MAX_TIMES = 10_000
T = TypeVar("T")


@contextmanager
def unpacked_files(sources: Mapping[str, bytes]) -> Iterator[Path]:
    """Unpack files into a temporary folder, by their names; it is deleted afterwards.

    Raises:
        RecordingError: a name leads out of the folder, or is no valid file name here.
    """
    with TemporaryDirectory(prefix="cellwright-") as made:
        folder = Path(made)
        for name, content in sources.items():
            path = path_inside(folder, name)
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            except (OSError, ValueError) as error:
                raise RecordingError(f"file {name!r:.80} in the recording cannot be unpacked: {error}") from None
        yield folder


def path_inside(folder: Path, name: object) -> Path:
    """Return the path of a named file in the folder.

    Raises:
        RecordingError: the path leads out of the folder, or is no valid path here.
    """
    if isinstance(name, str) and name and not re.search(r"[\\:\0\ud800-\udfff]", name):
        parts = PurePosixPath(name).parts
        if ".." not in parts and not PurePosixPath(name).is_absolute():
            return folder.joinpath(*parts)
    raise RecordingError(f"invalid file name {name!r:.80} in the recording")


class Stamps:
    """Wall clock [ns] of a recorded run: its time is that of the newest command."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        """Return its time [ns]."""
        return self.now


@dataclass(frozen=True)
class Rebuilt:
    """A rebuilt cell or robot, ready to run again.

    Attributes:
        served: the cell or the robot's node.
        stamps: the clock of its message stamps, if that was wall time.
        extras: handlers of input that bypasses the bus, by name.
        close: releases it.
    """

    served: DrawnNode
    stamps: Stamps = field(default_factory=Stamps)
    extras: Extras = field(default_factory=dict)
    close: Callable[[], None] = lambda: None

    def carry_out(self, command: Command) -> None:
        """Execute a command again; one that was refused is refused again.

        Raises:
            RecordingError: the command cannot be decoded.
        """
        if command.stamp is not None:
            self.stamps.now = command.stamp
        command.carry_out(self.served.bus, self.extras)


@contextmanager
def rebuild(recording: RecordingFile) -> Iterator[Rebuilt]:
    """Rebuild the recorded cell or robot; it is released afterwards.

    Raises:
        RecordingError: the recording lacks what is needed, or cannot be run again.
        CellwrightError: its files cannot be used here, such as a sensor of a package that is missing.
    """
    with unpacked_files(recording.sources) as folder:
        rebuilt = _robot(recording, folder) if recording.header.kind == "robot" else _cell(recording, folder)
        try:
            yield rebuilt
        finally:
            rebuilt.close()


def _cell(recording: RecordingFile, folder: Path) -> Rebuilt:
    facts = _Facts(recording.header.facts)
    with _packages(folder, facts):
        overrides = [Override.read(each, "overrides in the recording") for each in facts.texts("overrides")]
        trial = load_trial(_files(folder, facts), overrides=overrides).trial
    seed = facts.of("seed", int)
    bounds = facts.read("bounds", _bounds) if facts.of("varied", bool) else None
    trial = Start(seed, bounds).changed(joints=facts.read("joints", _joints), limits=trial.joints).of(trial)
    servo = facts.of("servo", str)
    if servo not in get_args(ServoProfile):
        raise RecordingError(f"unknown servo profile {servo!r:.40} in the recording")
    cell = Cell(trial, seed=seed, servo=cast("ServoProfile", servo), competition=facts.of("competition", bool))
    for when in facts.times("checkpoints"):
        cell.checkpoints.declare(when, None)
    cell.reset()
    cell.simulation.clock.offset = recording.header.clock_offset
    if recording.start is not None:
        start = folder / "start.npz"
        start.write_bytes(recording.start)
        read_checkpoint(cell.simulation, start)
    return Rebuilt(cell, extras=EntityServices(cell).replayed(), close=cell.simulation.close)


def _robot(recording: RecordingFile, folder: Path) -> Rebuilt:
    facts = _Facts(recording.header.facts)
    if facts.of("driver", bool):
        raise RecordingError("a driver moved this robot, not the simulation; the run cannot be repeated")
    with _packages(folder, facts):
        config = load_robot(_files(folder, facts)[0], lambda _line: None, facts.arguments("xacro_arguments"))
    stamps = Stamps()
    settings = RobotSettings(
        motion=facts.read("motion", Motion),
        timestep=facts.read("timestep", lambda value: Fraction(*value)),
        self_collision=facts.of("self_collision", bool),
        safety=facts.read("safety", _safety),
        node=facts.of("node", str),
        sim_time=facts.of("sim_time", bool),
    )
    node = RobotNode(config, settings, stamp=stamps)
    node.simulation.clock.offset = recording.header.clock_offset
    collected = _Collected()
    RobotServices(node).offer(collected)
    extras = collected.found | {f"{PREFIX}ResetSimulation": partial(_reset_time_again, node)}
    return Rebuilt(node, stamps, extras, node.close)


def _reset_time_again(node: RobotNode, request: dict[str, Any]) -> None:
    """Repeat a reset of the time alone; one of the state began another recording."""
    if request.get("scope", 0) in (TIME, TIME | SPAWNED):
        node.simulation.clock.restart_message_time()


class _Facts:
    """Values of an untrusted header."""

    def __init__(self, facts: Mapping[str, Any]) -> None:
        self._facts = facts

    def of(self, key: str, kind: type[T]) -> T:
        """Return a value of a type."""
        value = self._facts.get(key)
        if type(value) is not kind:
            raise self._lack(f"{key} is {value!r:.40}")
        return value

    def read(self, key: str, reader: Callable[[Any], T]) -> T:
        """Return a value converted by `reader`."""
        value = self._facts.get(key)
        try:
            return reader(value)
        except (TypeError, ValueError, KeyError, ZeroDivisionError):
            raise self._lack(f"{key} is {value!r:.40}") from None

    def names(self, key: str) -> list[Any]:
        """Return names of files."""
        value = self._facts.get(key)
        return value if isinstance(value, list) else []

    def arguments(self, key: str) -> dict[str, str]:
        """Return texts by name; empty if there are none, as in older recordings."""
        value = self._facts.get(key, {})
        if not isinstance(value, dict) or not all(isinstance(each, str) for pair in value.items() for each in pair):
            raise self._lack(f"{key} is {value!r:.40}")
        return value

    def texts(self, key: str) -> list[str]:
        """Return a list of texts; empty if there is none, as in older recordings."""
        value = self._facts.get(key, [])
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise self._lack(f"{key} is {value!r:.40}")
        return value

    def times(self, key: str) -> list[int]:
        """Return times [ns]."""
        found = [each for each in self.names(key)[:_MAX_TIMES] if type(each) is int and each >= 0]
        if found != self._facts.get(key):
            raise self._lack(f"{key} are not times")
        return found

    @staticmethod
    def _lack(lacking: str) -> RecordingError:
        return RecordingError(f"the header of the recording is incomplete; the run cannot be repeated: {lacking}")


class _Collected:
    """Collector of services that act, in place of a server."""

    def __init__(self) -> None:
        self.found: dict[str, Callable[[dict[str, Any]], object]] = {}

    def offer(self, service: str, handler: Callable[[dict[str, Any]], Any], *, acts: bool = False) -> None:
        if acts:
            self.found[service] = handler


def _files(folder: Path, facts: _Facts) -> list[Path]:
    found = [path_inside(folder, name) for name in facts.names("files")]
    if not found:
        raise RecordingError("the recording lacks the files that it was made from; the run cannot be repeated")
    # false also for a name that no file can have
    missing = [each.name for each in found if not os.path.isfile(each)]
    if missing:
        raise RecordingError(
            f"the recording lacks {missing[0]:.80}; it was cut short too early for the run to be repeated"
        )
    return found


def _bounds(values: Mapping[str, Any] | None) -> Bounds:
    return Bounds(**(values or {}))


def _joints(values: Mapping[str, Any] | None) -> dict[str, float]:
    return {} if values is None else dict(values)


def _safety(values: Mapping[str, Any]) -> SafetySettings:
    speeds = tuple((str(pattern), float(speed)) for pattern, speed in values["max_speeds"])
    topics = tuple(map(str, values["command_topics"]))
    return SafetySettings(**{**values, "max_speeds": speeds, "guard": Guard(values["guard"]), "command_topics": topics})


@contextmanager
def _packages(folder: Path, facts: _Facts) -> Iterator[None]:
    """Set ROS's package path to the packages of the recording."""
    before = os.environ.get(_PACKAGES)
    places: Sequence[str] = [str(path_inside(folder, name)) for name in facts.names("packages")]
    os.environ[_PACKAGES] = os.pathsep.join(places)
    try:
        yield
    finally:
        if before is None:
            del os.environ[_PACKAGES]
        else:
            os.environ[_PACKAGES] = before
