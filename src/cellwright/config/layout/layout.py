"""Layout of a cell as one frozen value: bins, belts, carriers, structure, and places for parts out of play.

All poses are in the world frame, lengths in m, angles in rad. `gear2017` returns the layout of the 2017 competition.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias, TypeVar

from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.config.layout.surroundings import FloorLine, Place, Structure, View
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

KeyFrames: TypeAlias = tuple[tuple[str, float, float], ...]
"""Time [s], as a decimal text, and x and y [m] of a carrier at each key frame of its path."""

Colour: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue and opacity, 0 to 1."""

T = TypeVar("T", "Bin", "Belt", "Carrier", "Tray")
PLATE_TOP = 0.005
"""Height [m] of the surface of a fixed tray over its link, as with an AGV's tray."""

Side: TypeAlias = Literal["+x", "-x", "+y", "-y"]
"""Side of a floor plan, by its axis."""

_DIGITS = 12
"""Digits to which a turned direction is rounded.

Without it, a quarter turn of x would leave 6e-17 of it, and move every part on a belt by the last bit of its place.
"""


@dataclass(frozen=True, slots=True)
class Bin:
    """Bin for parts.

    Attributes:
        name: its name in topics, frames and trials.
        pose: middle of its floor plan, at height 0; grids of parts go along x and y.
        link: pose of its model: `pose`, turned by any number of right angles, which may be rounded.
        size: edge lengths along x and y of the area for parts.
        surface: height of the surface that parts lie on.
        grid_height: height of the origin of its grids of parts.
        frame_height: height of its frame in the transform tree.
        walls: height of its walls over the surface; 0 for none.
        open: sides of `pose` that have a wall only near the corners.
        gap: distance from the area for parts to the walls.
    """

    name: str
    pose: Pose
    link: Pose
    size: tuple[float, float] = (0.6, 0.6)
    surface: float = 0.725
    grid_height: float = 0.75
    frame_height: float = 0.72
    walls: float = 0.06589
    open: tuple[Side, ...] = ()
    gap: float = 0.0

    @property
    def centre(self) -> tuple[float, float]:
        """Middle x, y."""
        return self.pose.position[0], self.pose.position[1]

    @property
    def corner(self) -> Pose:
        """Origin of its grids of parts: the corner of least x and y."""
        return self.pose @ Pose((-self.size[0] / 2, -self.size[1] / 2, self.grid_height))

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point of the world lies over its area for parts."""
        at = self.pose.inverse().transform((x, y, 0.0))
        return is_within(at[0], self.size[0]) and is_within(at[1], self.size[1])


@dataclass(frozen=True, slots=True)
class Belt:
    """Conveyor belt.

    Attributes:
        name: its name in trials and frames.
        body: name of its body and of the geom with the moving surface.
        centre: middle of the belt's box; x points in the direction of travel.
        size: length, width and thickness of that box.
        speed: speed at full power [m/s].
        direction: unit vector of travel in the world.
        spawn: frame of the poses of the parts that appear on it; x points in the direction of travel.
        frame: the frame `belt_frame` of the transform tree.
        wall: middle of the box at its end that removes the parts that touch it; None if parts drop off its end.
        wall_size: edge lengths of that box.
    """

    name: str
    body: str
    centre: Pose
    size: Vector3
    speed: float
    direction: Vector3
    spawn: Pose
    frame: Pose
    wall: Pose | None
    wall_size: Vector3 = (1.0, 0.1, 1.0)

    @property
    def surface(self) -> float:
        """Height of the surface that parts ride on."""
        return self.centre.position[2] + self.size[2] / 2

    @property
    def link(self) -> str:
        """Name of the frame in its middle, for parts that a trial puts on it."""
        return f"{self.body}::belt"

    def along(self, point: Iterable[float]) -> float:
        """Return the coordinate of a point of the world in the direction of travel [m]."""
        return sum(value * share for value, share in zip(point, self.direction, strict=True))

    @property
    def end(self) -> float:
        """Coordinate of its end in the direction of travel [m]."""
        return self.along(self.centre.position) + self.size[0] / 2

    @property
    def exit(self) -> float:
        """Coordinate in the direction of travel where parts leave it [m]: at its wall, or at its end."""
        return self.end if self.wall is None else self.along(self.wall.position)

    def covers(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Return whether a point of the world lies over the belt, or at most `margin` [m] beside it."""
        at = self.centre.inverse().transform((x, y, self.surface))
        return is_within(at[0], self.size[0] + 2 * margin) and is_within(at[1], self.size[1] + 2 * margin)


@dataclass(frozen=True, slots=True)
class Carrier:
    """AGV with a tray, which takes a kit away.

    Attributes:
        number: its number, from 1, in the names of its tray and sensor.
        name: its name in topics, frames and trials.
        home: its station, where it is loaded, at height 0.
        tray_link: name of the tray's link.
        tray_frame: pose of the tray's link at the station, as trials mean it.
        quality: pose of the quality control sensor over the tray.
        out: key frames of the way from the station to the place where the kit leaves the cell.
        back: key frames of the way back.
        axes: directions in the world of x and y of the key frames.
        colour: colour of its chassis.
        home_T_tray: pose of the tray's link in its own frame, in front of its mast.
        plate: edge lengths of the tray's plate along x and y of the tray's link, whose origin is in its middle.
        surface: height of the surface that parts lie on.
    """

    number: int
    name: str
    home: Pose
    tray_link: str
    tray_frame: Pose
    quality: Pose
    out: KeyFrames
    back: KeyFrames
    axes: tuple[Vector3, Vector3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    colour: Colour = (0.5, 0.5, 0.5, 1.0)
    home_T_tray: Pose = field(default_factory=lambda: Pose((0.0, 0.15, 0.75)))
    plate: tuple[float, float] = (0.5, 0.7)
    surface: float = 0.755

    @property
    def load_point(self) -> Pose:
        """Frame of its load point, at the height of its tray's link."""
        return self.home @ Pose((0.0, 0.0, self.home_T_tray.position[2]))

    @property
    def location(self) -> str:
        """Name of its storage unit, whose frame has `_frame` in addition."""
        return f"{self.name}_load_point"

    @property
    def tray_surface(self) -> Pose:
        """Middle of the surface that parts lie on, at the station."""
        x, y, _ = (self.home @ self.home_T_tray).position
        return Pose((x, y, self.surface), self.home.quaternion)

    @property
    def tray_name(self) -> str:
        """Name of its tray in topics and frames."""
        return f"kit_tray_{self.number}"

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point of the world lies over the plate at the station."""
        at = self.tray_frame.inverse().transform((x, y, self.tray_frame.position[2]))
        return is_on_plate(at[0], at[1], self.plate)


@dataclass(frozen=True, slots=True)
class Tray:
    """Fixed tray: a kit is built and submitted where it stands.

    Attributes:
        number: its number, in the name of its tray; numbers go on after those of the carriers.
        name: its name in topics, frames and trials.
        pose: middle of its plate, at height 0.
        size: edge lengths of its plate along x and y.
        surface: height of the surface that parts lie on.
        rim: height of its rim over that surface; 0 for none.
    """

    number: int
    name: str
    pose: Pose
    size: tuple[float, float] = (0.5, 0.7)
    surface: float = 0.755
    rim: float = 0.0204

    @property
    def tray_link(self) -> str:
        """Name of its link."""
        return f"{self.name}::{self.tray_name}::tray"

    @property
    def tray_frame(self) -> Pose:
        """Pose of its link, as trials mean it: as far below the surface as that of an AGV's tray."""
        return self.pose @ Pose((0.0, 0.0, self.surface - PLATE_TOP))

    @property
    def plate(self) -> tuple[float, float]:
        """Edge lengths of its plate along x and y of its link, whose origin is in its middle."""
        return self.size

    @property
    def location(self) -> str:
        """Name of its storage unit, whose frame has `_frame` in addition."""
        return self.name

    @property
    def tray_surface(self) -> Pose:
        """Middle of the surface that parts lie on."""
        return self.pose @ Pose((0.0, 0.0, self.surface))

    @property
    def tray_name(self) -> str:
        """Name of its tray in topics and frames."""
        return f"kit_tray_{self.number}"

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point of the world lies over the plate."""
        at = self.pose.inverse().transform((x, y, 0.0))
        return is_on_plate(at[0], at[1], self.size)


Station: TypeAlias = Carrier | Tray
"""Place with a tray where a kit is built."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of a cell.

    Attributes:
        frame: pose of the whole layout in the world.
        bins: the bins, in the order of their bodies.
        belts: the belts.
        carriers: the AGVs.
        arms: places for arms; the trial decides whether they are there.
        shelf: middle of the shelf for parts that are not in play, at height 0.
        trays: the fixed trays.
        structure: posts, bars and tables, in the order of their bodies.
        floor_lines: lines on the floor.
        views: camera presets.
        places: named poses of the user's.
        arm_clearance: distance [m] that a guard keeps between arms; None without a guard.
        robots: robots that are driven over their own topics.

    The shelf is outside every view, and in line with the cell. The engine's broad phase uses boxes along the principal
    axes of all objects. A shelf to one side would skew these axes, and every flat object would fill a fat box.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> layout = gear2017()
        >>> [each.name for each in layout.carriers], layout.bin("bin7").centre
        (['agv1', 'agv2'], (-0.3, 0.23))
    """

    frame: Pose
    bins: tuple[Bin, ...]
    belts: tuple[Belt, ...]
    carriers: tuple[Carrier, ...]
    arms: tuple[Arm, ...]
    shelf: Pose
    trays: tuple[Tray, ...] = ()
    structure: tuple[Structure, ...] = ()
    floor_lines: tuple[FloorLine, ...] = ()
    views: tuple[View, ...] = ()
    places: tuple[Place, ...] = ()
    arm_clearance: float | None = None
    robots: tuple[CellRobot, ...] = ()

    @property
    def stations(self) -> tuple[Station, ...]:
        """All places with a tray, in the order of their numbers: carriers, then fixed trays."""
        return (*self.carriers, *self.trays)

    @property
    def reference_frames(self) -> Mapping[str, Pose]:
        """World poses of the frames that `models_to_spawn` accepts, by name."""
        return {
            "world": Pose(),
            # a belt's middle, turned as the frame in which its parts appear
            **{each.link: Pose(each.centre.position, each.spawn.quaternion) for each in self.belts},
            **{f"{each.name}::link": each.link for each in self.bins},
            **self.tray_frames,
        }

    @property
    def tray_frames(self) -> Mapping[str, Pose]:
        """World poses of the trays' links at their stations, by name."""
        return {each.tray_link: each.tray_frame for each in self.stations}

    def bin(self, name: str) -> Bin:
        """Return a bin by its name, or raise an UnknownNameError."""
        return _named("bin", name, self.bins)

    def belt(self, name: str) -> Belt:
        """Return a belt by its name, or raise an UnknownNameError."""
        return _named("belt", name, self.belts)

    def carrier(self, name: str) -> Carrier:
        """Return a carrier by its name, or raise an UnknownNameError."""
        return _named("AGV", name, self.carriers)

    def tray(self, name: str) -> Tray:
        """Return a fixed tray by its name, or raise an UnknownNameError."""
        return _named("tray", name, self.trays)

    def moved(self, by: Pose) -> Layout:
        """Return the whole layout moved and turned about the vertical: `by` maps the old world to the new one."""

        def turn(vector: Vector3) -> Vector3:
            x, y, z = by.rotate(vector)
            return (round(x, _DIGITS) + 0.0, round(y, _DIGITS) + 0.0, round(z, _DIGITS) + 0.0)

        return Layout(
            frame=by @ self.frame,
            bins=tuple(replace(each, pose=by @ each.pose, link=by @ each.link) for each in self.bins),
            belts=tuple(
                replace(
                    each,
                    centre=by @ each.centre,
                    direction=turn(each.direction),
                    spawn=by @ each.spawn,
                    frame=by @ each.frame,
                    wall=None if each.wall is None else by @ each.wall,
                )
                for each in self.belts
            ),
            carriers=tuple(
                replace(
                    each,
                    home=by @ each.home,
                    tray_frame=by @ each.tray_frame,
                    quality=by @ each.quality,
                    axes=(turn(each.axes[0]), turn(each.axes[1])),
                )
                for each in self.carriers
            ),
            arms=tuple(each.moved(by) for each in self.arms),
            shelf=by @ self.shelf,
            trays=tuple(replace(each, pose=by @ each.pose) for each in self.trays),
            structure=tuple(each.moved(by) for each in self.structure),
            floor_lines=tuple(each.moved(by) for each in self.floor_lines),
            views=tuple(each.moved(by) for each in self.views),
            places=tuple(each.moved(by) for each in self.places),
            arm_clearance=self.arm_clearance,
            robots=tuple(each.moved(by) for each in self.robots),
        )


def is_within(offset: float, length: float) -> bool:
    """Return whether an offset from the middle of an edge lies on it, to a nanometre."""
    return abs(offset) <= length / 2 + 1e-9


def is_on_plate(x: float, y: float, plate: tuple[float, float]) -> bool:
    """Return whether a point of a tray's frame lies on its plate."""
    return is_within(x, plate[0]) and is_within(y, plate[1])


def _named(kind: str, name: str, known: tuple[T, ...]) -> T:
    for each in known:
        if each.name == name:
            return each
    raise UnknownNameError(kind, name, [each.name for each in known])
