"""A recorded motion of a robot, as figures to compare with: the file `reference_motion.json` beside its configuration.

Its own key `about` says how samples are counted.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.config.parsing.contents import read_at_most
from cellwright.config.parsing.problems import Place, Problem
from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.servos import Array
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

LARGEST = 64 << 20
"""A larger file is not read [bytes]."""
FILE = "reference_motion.json"


@dataclass(frozen=True)
class Hand:
    """Where a link is in the world, with the robot as it is put up."""

    link: str
    pose: Pose


@dataclass(frozen=True)
class Closing:
    """A gripper that is told a status once: its status, 0 to 1, at times since then [s]."""

    gripper: int
    status: float
    times: Array
    statuses: Array


@dataclass(frozen=True)
class Mapping:
    """Where the joints of a gripper are [rad; m] for a status."""

    gripper: int
    status: float
    positions: tuple[float, ...]


@dataclass(frozen=True)
class Step:
    """A joint that is told a target once: its positions [rad; m] at times since then [s]."""

    joint: str
    start: float
    target: float
    times: Array
    positions: Array


@dataclass(frozen=True)
class Sine:
    """A joint that is told target after target, and where it is when the next one comes [s; rad; m]."""

    joint: str
    period: float
    targets: Array
    positions: Array


@dataclass(frozen=True)
class ReferenceMotion:
    """All that was recorded of a robot.

    Attributes:
        joints: names of the joint states, in their order.
        hands: poses at home.
        gripper_joints: of each gripper, right and left.
        mappings: what a status means.
        closings: grippers on their way.
        steps: responses to one target.
        sines: responses to many.
    """

    joints: tuple[str, ...]
    hands: tuple[Hand, ...]
    gripper_joints: tuple[tuple[str, ...], ...]
    mappings: tuple[Mapping, ...]
    closings: tuple[Closing, ...]
    steps: tuple[Step, ...]
    sines: tuple[Sine, ...]


def find_reference(config: RobotConfig) -> Path | None:
    """The recorded motion that comes with a robot; None if none does."""
    path = config.path.parent / FILE
    return path if path.is_file() else None


def read_reference(path: Path) -> ReferenceMotion:
    """Read a recorded motion.

    Raises:
        UsageError: it cannot be read, or is none.
    """
    try:
        content = read_at_most(path, LARGEST)
        if content is None:
            raise UsageError(f"{path}: this is no recorded motion: larger than {LARGEST >> 20} MiB")
        return _reference(json.loads(content.decode("utf-8")))
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, OverflowError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        message = f"this is no recorded motion: {type(error).__name__}: {error}"
        raise UsageError(str(Problem(Place(0, str(path), 0), "", shortened(message, 300)))) from error


def _reference(read: dict[str, Any]) -> ReferenceMotion:
    second = float(read["steps_per_second"])
    grippers = read["grippers"]
    return ReferenceMotion(
        joints=tuple(map(str, read["joints"])),
        hands=tuple(Hand(each["link"], _pose(each["position"], each["orientation"])) for each in read["hands"]),
        gripper_joints=tuple(tuple(each["joints"]) for each in grippers),
        mappings=tuple(
            Mapping(number, float(known["status"]), tuple(_numbers(known["joints"]).tolist()))
            for number, each in enumerate(grippers)
            for known in each["positions"]
        ),
        closings=tuple(
            Closing(int(each["gripper"]), float(each["status"]), *_samples(each["samples"], second))
            for each in read["closing"]
        ),
        steps=tuple(
            Step(each["joint"], float(each["start"]), float(each["target"]), *_samples(each["samples"], second))
            for each in read["steps"]
        ),
        sines=tuple(_sine(each) for each in read["sines"]),
    )


def _samples(samples: list[list[float]], second: float) -> tuple[Array, Array]:
    steps, values = _numbers(samples).T
    return steps / second, values


def _sine(read: dict[str, Any]) -> Sine:
    _, targets, positions = _numbers(read["samples"]).T
    return Sine(read["joint"], 1.0 / float(read["rate"]), targets, positions)


def _pose(position: list[float], xyzw: list[float]) -> Pose:
    x, y, z, w = _numbers(xyzw) / np.linalg.norm(_numbers(xyzw))
    position = _numbers(position).tolist()
    at: Vector3 = (float(position[0]), float(position[1]), float(position[2]))
    return Pose(at, (float(w), float(x), float(y), float(z)))


def _numbers(values: Any) -> Array:
    """Numbers as an array; with one that is not finite, a comparison would come out well whatever was measured."""
    found: Array = np.array(values, dtype=np.float64)
    if not np.isfinite(found).all():
        raise ValueError("a number is not finite")
    return found
