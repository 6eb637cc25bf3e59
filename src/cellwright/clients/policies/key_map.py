"""Map between the names of a policy and those of a cell: what the policy sees, and what its numbers command."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from cellwright.clients.policies.rotations import SIZES
from cellwright.config.control import ControlSpace

RATE = 20.0
"""Control periods in a second [Hz] of a map that gives none."""
SENTENCE = "{sentence}"
"""Place of the task's sentence in a text."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Names of a cell, or of a robot's node, that a map may use.

    Attributes:
        space: the channels.
        cameras: cameras with colours.
        arms: joints of each arm, by its name: names of channels.
        timestep: length of a tick [s], as numerator and denominator.
        grippers_of_arms: the gripper of each arm that has one, by the arm's name.
    """

    space: ControlSpace
    cameras: Sequence[str]
    arms: Mapping[str, Sequence[str]]
    timestep: tuple[int, int]
    grippers_of_arms: Mapping[str, str] = field(default_factory=dict)

    @property
    def grippers(self) -> tuple[str, ...]:
        """Channels that are no joints."""
        return tuple(each.name for each in self.space.channels if each.kind != "joint")


@dataclass(frozen=True, slots=True)
class Channels:
    """Measured values of channels, float32."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ToolPose:
    """Measured pose of an arm's tool, float32: position [m], then rotation in a form, in the frame base or world."""

    arm: str
    rotation: str = "quaternion_xyzw"
    frame: str = "base"


@dataclass(frozen=True, slots=True)
class Grip:
    """Share by which a gripper is closed, float32: numbers between those of an open and of a closed one."""

    name: str
    open: tuple[float, ...] = (0.0,)
    closed: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, slots=True)
class Picture:
    """Newest picture of a camera, uint8.

    Attributes:
        camera: name of the camera.
        size: width and height [px] to which it is fitted, with black borders; None leaves it as it is.
        turned: True if it is turned by half a turn.
        mirrored: True if left and right change places.
        is_planar: True if colours come first, (3, H, W), and not last.
    """

    camera: str
    size: tuple[int, int] | None = None
    turned: bool = False
    mirrored: bool = False
    is_planar: bool = False


@dataclass(frozen=True, slots=True)
class Words:
    """A text; `{sentence}` in it stands for that of the task."""

    text: str


@dataclass(frozen=True, slots=True)
class Constant:
    """The same numbers at each request, float32."""

    numbers: tuple[float, ...]


Numbers: TypeAlias = Channels | ToolPose | Grip | Constant
Source: TypeAlias = "Numbers | Picture | Words | tuple[Numbers, ...] | Mapping[str, Source]"
"""Origin of an entry of an observation; several sources of numbers are joined, and mappings are nested."""


@dataclass(frozen=True, slots=True)
class ToChannels:
    """Numbers for channels, one each: targets, or steps from the last targets, after `number * scale + offset`.

    Before that, each is clipped to the `limit` on either side of 0.
    """

    names: tuple[str, ...]
    steps: bool = False
    scale: float = 1.0
    offset: float = 0.0
    limit: float = math.inf


@dataclass(frozen=True, slots=True)
class ToGripper:
    """One number for a gripper: above the threshold it closes, or below; a suction that is closed is on.

    Attributes:
        ends: numbers of an open and of a closed gripper, in place of the threshold: those between close it in part.
    """

    name: str
    threshold: float = 0.5
    closes_above: bool = True
    ends: tuple[float, float] | None = None

    def share(self, number: float) -> float:
        """Return how far a number closes the gripper, from 0 to 1.

        Example:
            >>> ToGripper("suction", threshold=0.0).share(0.3), ToGripper("width", ends=(1.0, 0.0)).share(0.75)
            (1.0, 0.25)
        """
        if self.ends is None:
            return float((number > self.threshold) == self.closes_above)
        opened, closed = self.ends
        return min(1.0, max(0.0, (number - opened) / (closed - opened)))


@dataclass(frozen=True, slots=True)
class ToTool:
    """Numbers for the pose of an arm's tool: a position, then a rotation in a form.

    Attributes:
        steps: steps from the last target, and not targets.
        frame: `base` or `world`, or `tool` for steps along and about the axes of the tool.
        scale: factor of the position [m].
        turn_scale: factor of a step's rotation [rad].
        limit: bound of each number on either side of 0, before that.
    """

    arm: str
    rotation: str = "axis_angle"
    steps: bool = False
    frame: str = "base"
    scale: float = 1.0
    turn_scale: float = 1.0
    limit: float = math.inf


@dataclass(frozen=True, slots=True)
class Skip:
    """Numbers without a use here."""

    count: int


Part: TypeAlias = ToChannels | ToGripper | ToTool | Skip


@dataclass(frozen=True)
class KeyMap:
    """A map as read.

    Attributes:
        observation: sources by the policy's names.
        actions: parts of an action, in the order of its numbers.
        rate: control periods in a second [Hz].
        chunk: number of actions after which the policy is asked again; None: see `Schedule`.
        drops_stale: as for `Schedule`.
        dialect: dialect of the wire; empty to find out.
        text: the file's text; empty for the map that the cell gives.
    """

    observation: Mapping[str, Source]
    actions: tuple[Part, ...]
    rate: float = RATE
    chunk: int | None = None
    drops_stale: bool | None = None
    dialect: str = ""
    text: str = field(default="", repr=False)

    @property
    def size(self) -> int:
        """Count of numbers that an action must have."""
        return sum(size_of(part) for part in self.actions)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The cameras whose pictures it uses."""
        return tuple(dict.fromkeys(_cameras_of(self.observation)))

    def channels(self, cell: Cell) -> frozenset[str]:
        """Return the names of the channels that it commands."""
        found: set[str] = set()
        for part in self.actions:
            match part:
                case ToChannels(names):
                    found.update(names)
                case ToGripper(name):
                    found.add(name)
                case ToTool(arm):
                    found.update(cell.arms[arm])
        return frozenset(found)


def size_of(part: Part) -> int:
    """Return how many numbers of an action a part takes."""
    match part:
        case ToChannels():
            return len(part.names)
        case ToGripper():
            return 1
        case ToTool():
            return 3 + SIZES[part.rotation]
    return part.count


def default_map(cell: Cell) -> KeyMap:
    """Return the map of a policy that uses the cell's own names.

    It sees `state`, all channels in their order; `images`, each colour camera by its name, 224 × 224; and `prompt`. It
    answers with targets of all channels.
    """
    pictures: dict[str, Source] = {name: Picture(name, (224, 224)) for name in cell.cameras}
    names = cell.space.names
    observation: dict[str, Source] = {"state": Channels(names), "prompt": Words(SENTENCE)}
    return KeyMap({**observation, **({"images": pictures} if pictures else {})}, (ToChannels(names),))


def _cameras_of(source: Source) -> Iterator[str]:
    if isinstance(source, Picture):
        yield source.camera
    elif isinstance(source, Mapping):
        for each in source.values():
            yield from _cameras_of(each)
