"""Random scenes for collision culling: parts laid, thrown, pushed, gripped and driven; the same in any cell.

A scene is data. `SceneRun` plays it in a cell with culling or without, tick by tick, from the start or from a snapshot.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.models.model import Furniture, ModelShape, UserModel
from cellwright.config.trial.trial import Circumstances, Part, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.motion.joints import Joints
from cellwright.motion.kinematics import solve, tool_down
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose
from tests.support.cells import INITIAL, SENSORS, with_culling
from tests.support.places import BELT_SURFACE, BIN_CENTRES, BIN_SURFACE, TRAY_SURFACE

BELT_X = 1.21


def _box(name: str, size: tuple[float, float, float], centre: tuple[float, float, float]) -> Furniture:
    return Furniture(name, UserModel((ModelShape("box", size),)), Pose(centre))


FURNITURE = (
    (),
    (_box("gate", (0.7, 0.05, 0.05), (BELT_X, 1.5, BELT_SURFACE + 0.045)),),  # low over the belt: parts jam below it
    (_box("post", (0.1, 0.1, 1.2), (BELT_X - 0.3, 2.5, 0.6)), _box("bar", (0.7, 0.04, 0.04), (BELT_X, 0.5, 1.0))),
    (_box("table", (0.5, 0.5, 0.85), (0.7, 1.2, 0.425)),),
)
"""Furniture of the user's own, by layout: over the belt, into it, beside it."""


class Spot(NamedTuple):
    """A place to lay a part: a named surface, a position on it (-1 to 1 each way), a height above it [m], a turn."""

    surface: str
    u: float
    v: float
    above: float
    roll: float
    yaw: float

    def pose(self, kind: str) -> Pose:
        """Return world_T_part for a part of this type."""
        (x, y, z), (half_x, half_y) = SURFACES[self.surface]
        lift = -part_type(kind).bottom if self.roll == 0.0 else 0.12  # a tilted part falls onto it
        position = (x + half_x * self.u, y + half_y * self.v, z + lift + self.above)
        return Pose.from_rpy(position, (self.roll, 0.0, self.yaw))


SURFACES = {
    **{name: ((x, y, BIN_SURFACE), (0.2, 0.2)) for name, (x, y) in BIN_CENTRES.items()},
    "wall between bins": ((-0.3, 0.6125, 0.791), (0.25, 0.06)),
    "side of bin5": ((-0.3, -1.33 - 0.3215, 0.791), (0.25, 0.02)),
    "belt": ((BELT_X, 1.5, BELT_SURFACE), (0.22, 2.5)),
    "belt, near": ((BELT_X, 0.6, BELT_SURFACE), (0.05, 0.6)),
    "belt's edge": ((BELT_X - 0.327, 1.0, BELT_SURFACE), (0.03, 2.0)),
    "belt's outer edge": ((BELT_X + 0.327, 1.0, BELT_SURFACE), (0.03, 2.0)),
    "belt's end": ((BELT_X, -3.6, BELT_SURFACE), (0.2, 0.4)),
    "tray 1": ((0.3, 3.15, TRAY_SURFACE), (0.12, 0.2)),
    "tray 2": ((0.3, -3.15, TRAY_SURFACE), (0.12, 0.2)),
    "rim of tray 1": ((0.3, 3.15 + 0.35, TRAY_SURFACE + 0.02), (0.15, 0.02)),
    "mast of agv2": ((0.3, -3.15 - 0.425, TRAY_SURFACE + 0.1), (0.1, 0.05)),
    "rail": ((0.3, 0.0, 1.0), (0.1, 1.8)),
    "fence": ((1.7, 1.0, 0.975), (0.02, 2.0)),
    "below the belt": ((BELT_X, 1.0, 0.0), (0.3, 2.0)),
    "way of agv1": ((-2.0, 3.4, 0.0), (1.5, 0.3)),
    "floor": ((0.3, 1.8, 0.0), (0.8, 0.8)),
}
"""Centre [m] and half extents [m] of the surfaces."""


class Push(NamedTuple):
    """Force [N] on a part, world frame, over ticks."""

    begin: int
    end: int
    part: int
    force: tuple[float, float, float]


class Command(NamedTuple):
    """Something that happens before a tick: `kind` names a method of `SceneRun`."""

    tick: int
    kind: str
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Scene:
    """A whole scene; `parts` are types and where they lie at first, `ticks` its length."""

    layout: int
    friction: float
    parts: tuple[tuple[str, Spot], ...]
    commands: tuple[Command, ...]
    pushes: tuple[Push, ...]
    ticks: int

    def trial(self, *, culling: bool) -> Trial:
        """Return its cell, with culling or without."""
        parts = [Part(self.part(number), kind, spot.pose(kind)) for number, (kind, spot) in enumerate(self.parts)]
        trial = Trial(
            "scene",
            has_arm=True,
            sensors=SENSORS,
            bin_parts=tuple(parts),
            furniture=FURNITURE[self.layout],
            circumstances=Circumstances(friction=self.friction),
            time_limit=None,
        )
        return with_culling(trial, culling)

    def part(self, number: int) -> str:
        """Return the name of a part."""
        return f"scene|{self.parts[number][0]}_{number + 1}"


@cache
def posture(x: float, y: float, z: float) -> tuple[float, ...] | None:
    """Return the arm's posture with the face of the cup at a place [m], pointing down; None if it is out of reach."""
    try:
        return tuple(solve(tool_down(x, y, z), Joints(*INITIAL)))
    except UnreachableError:
        return None


class Pushes(Device):
    """External forces, as a device of a plugin exerts them; their time is the clock's."""

    def __init__(self, scene: Scene, cell: Cell) -> None:
        super().__init__("pushes")
        self._pushes = [(push, cell.parts.part(scene.part(push.part)).body) for push in scene.pushes]

    def before_step(self) -> None:
        """Exert the forces of this tick; a force that has ended is taken back once."""
        tick, applied = self.simulation.clock.tick, self.simulation.data.xfrc_applied
        for push, body in self._pushes:
            if push.begin <= tick < push.end:
                applied[body, :3] = push.force
            elif tick == push.end:
                applied[body, :3] = 0.0


class SceneRun:
    """A scene in a cell of its own; `step` gives the commands of the present tick and steps."""

    def __init__(self, scene: Scene, *, culling: bool) -> None:
        self.scene = scene
        self.cell = Cell(scene.trial(culling=culling), competition=False)
        self.simulation = self.cell.simulation
        devices = self.simulation.devices
        last = {name: devices.pop(name) for name in ("collision_culling",) if name in devices}
        self.simulation.add(Pushes(scene, self.cell))  # where a plugin's device is: before the culling, which is last
        devices.update(last)
        self.simulation.collect_hooks()
        self.cell.reset()
        self.parts = [self.cell.parts.part(scene.part(number)) for number in range(len(scene.parts))]
        self._commands: dict[int, list[Command]] = {}
        for command in scene.commands:
            self._commands.setdefault(command.tick, []).append(command)

    @property
    def tick(self) -> int:
        """Number of ticks so far."""
        return self.simulation.clock.tick

    def command(self) -> None:
        """Give the commands of this tick."""
        for command in self._commands.get(self.tick, ()):
            getattr(self, command.kind)(*command.arguments)

    def step(self) -> None:
        """Give the commands of this tick, and step."""
        self.command()
        self.cell.step()

    def power(self, percent: float) -> None:
        """Set the belt's power."""
        self.cell.conveyors["belt"].set_power(percent)

    def throw(self, number: int, velocity: tuple[float, ...]) -> None:
        """Give a part a velocity (linear [m/s], angular [rad/s])."""
        part = self.parts[number]
        if part.name in self.cell.parts.in_play and not self.is_held(number):
            self.simulation.data.qvel[part.dof : part.dof + 6] = velocity
            self.simulation.keep_awake(part.body)

    def place(self, number: int, spot: Spot) -> None:
        """Put a part elsewhere."""
        part = self.parts[number]
        self.cell.parts.place(part, spot.pose(part.type))

    def put_away(self, number: int) -> None:
        """Take a part out of play."""
        self.cell.parts.put_away(self.parts[number])

    def send(self, agv: int) -> None:
        """Send an AGV off with its tray."""
        self.cell.agvs[agv].send("kit")

    def grip(self, enabled: bool) -> None:
        """Switch the vacuum."""
        assert self.cell.gripper is not None
        self.cell.gripper.set_enabled(enabled)

    def move(self, waypoints: tuple[tuple[tuple[float, ...], float], ...]) -> None:
        """Move the arm through postures, each with its duration [s], at rest in each."""
        assert self.cell.arm is not None
        rest, points, time = [0.0] * len(ARM_JOINTS), [], 0.0
        for goal, seconds in waypoints:
            time += seconds
            points.append(TrajectoryPoint(list(goal), rest, rest, nanoseconds(time)))
        self.cell.arm.command(JointTrajectory(ARM_JOINTS, points))

    def is_held(self, number: int) -> bool:
        """Return whether a part is in the cup, or locked to a tray."""
        part, active = self.parts[number], self.simulation.data.eq_active
        return any(active[weld] for weld in (*part.grips.values(), *part.locks.values()))


_SHARE = st.floats(-1.0, 1.0).map(lambda value: round(value, 3))
_POWER = st.sampled_from((100.0, 100.0, 100.0, 60.0, 20.0, 3.0, 0.5, 0.1, 0.0))
_KINDS = st.sampled_from(sorted(PART_TYPES))


def _spot(*surfaces: str) -> st.SearchStrategy[Spot]:
    return st.builds(
        Spot,
        surface=st.sampled_from(surfaces or sorted(SURFACES)),
        u=_SHARE,
        v=_SHARE,
        above=st.sampled_from((0.0003, 0.0003, 0.02, 0.1, 0.3)),
        roll=st.sampled_from((0.0, 0.0, 0.0, 0.4, 1.57)),
        yaw=st.sampled_from((0.0, 0.0, 0.7, 1.57)),
    )


@st.composite
def _dive(draw: st.DrawFn) -> tuple[Any, ...]:
    """Draw a path down into a bin or onto the belt, perhaps into what lies there, and up again."""
    surface = draw(st.sampled_from(("bin5", "bin6", "bin7", "bin8", "bin7", "belt, near", "tray 1")))
    (x, y, z), (half_x, half_y) = SURFACES[surface]
    x, y = x + half_x * draw(_SHARE), y + half_y * draw(_SHARE)
    depth = draw(st.sampled_from((0.03, 0.015, 0.005, -0.01)))
    sideways = draw(st.sampled_from((0.0, 0.0, 0.1)))
    above, low, aside = (posture(x, y + dy, z + h) for dy, h in ((0.0, 0.25), (0.0, depth), (sideways, depth)))
    if above is None or low is None or aside is None:
        return (((INITIAL, 1.0),),)
    fast = draw(st.sampled_from((0.15, 0.3, 0.6)))
    return (((above, draw(st.sampled_from((0.5, 1.0)))), (low, fast), (aside, 0.3), (above, fast)),)


@st.composite
def _swing(draw: st.DrawFn) -> tuple[Any, ...]:
    """Draw a fast swing of the whole arm."""
    goal = tuple(
        each + draw(_SHARE) * reach for each, reach in zip(INITIAL, (1.5, 1.5, 0.8, 0.6, 1, 1, 3), strict=True)
    )
    return (((goal, draw(st.sampled_from((0.3, 0.8, 1.5)))), (INITIAL, 0.8)),)


@st.composite
def scenes(draw: st.DrawFn, ticks: int = 1500) -> Scene:
    """Draw a scene."""
    layout = draw(st.integers(0, len(FURNITURE) - 1))
    spots = [draw(_spot("belt")) for _ in range(draw(st.integers(1, 4)))]
    spots = [spot._replace(roll=0.0, above=0.0003) for spot in spots]
    spots += [draw(_spot("bin6", "bin7")) for _ in range(draw(st.integers(0, 4)))]
    spots += [draw(_spot()) for _ in range(draw(st.integers(0, 6)))]
    parts = tuple((draw(_KINDS), spot) for spot in spots)
    number, when = st.integers(0, len(parts) - 1), st.integers(1, ticks - 200)
    velocity = st.tuples(*[_SHARE.map(lambda value: 3.0 * value)] * 3, *[_SHARE.map(lambda value: 10.0 * value)] * 3)
    kinds: dict[str, st.SearchStrategy[tuple[Any, ...]]] = {
        "power": st.tuples(_POWER),
        "throw": st.tuples(number, velocity),
        "place": st.tuples(number, _spot()),
        "put_away": st.tuples(number),
        "send": st.tuples(st.sampled_from((1, 2))),
        "grip": st.tuples(st.booleans()),
        "move": st.one_of(_dive(), _dive(), _swing()),
    }
    drop = st.builds(Command, when, st.just("place"), st.tuples(number, _spot("belt", "belt, near")))
    any_command = st.one_of(*(st.builds(Command, when, st.just(kind), each) for kind, each in kinds.items()), drop)
    commands = [Command(0, "power", (draw(_POWER),)), *draw(st.lists(any_command, max_size=8))]
    force = st.tuples(*[_SHARE.map(lambda value: 15.0 * value)] * 3)
    pushes = [
        Push(begin, begin + duration, part, wanted)
        for begin, duration, part, wanted in draw(
            st.lists(st.tuples(when, st.sampled_from((1, 20, 150)), number, force), max_size=2)
        )
    ]
    return Scene(
        layout,
        draw(st.sampled_from((1.0, 0.6))),
        parts,
        tuple(sorted(commands, key=lambda each: each.tick)),
        tuple(pushes),
        ticks,
    )
