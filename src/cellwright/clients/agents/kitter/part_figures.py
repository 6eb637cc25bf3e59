"""Part figures of the agent: the grip and the floor plan of each type.

Figures of the part types of 2017 come from their models, which every team had. Those of a trial's own types come from
the cell (`Client.part_types`); poses of parts come from sensors alone.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose

MAX_HEIGHT = 0.2
"""Largest distance [m] that a part may hang below the cup. The tallest one tried, 0.21 m, cleared rail and rims."""
MAX_MASS = 10.0
"""Payload of the arm [kg]. A box of 12 kg came to lie within 1 mm of its place, one of 16 kg 15 mm beside it."""
MIN_SPOT = 0.006
"""Radius [m] of the flat disc that the cup needs: it is aimed to a few millimetres."""
MAX_MOMENT = 0.3
"""Largest mass of a part times the distance of its centre of mass from the cup's axis [kg m].

In trials a bar of 0.56 kg m came to lie 6 mm off its place. With 0.8 kg m the wrist gave way, and the part was lost.
"""


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in the plane that a part lies in: x, y [m] in the part's frame, radius [m]."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class PartFigures:
    """A part type as the agent handles it."""

    grip: tuple[float, float]
    """Place of the cup's middle: x, y [m] in the part's frame. There the cup's face (radius 38 mm) meets something
    solid and stays clear of a mark where it can.
    """
    top: float
    """Height [m] above the part's origin at which the cup first meets it."""
    outline: tuple[Disc, ...]
    """Discs that together cover the part's floor plan."""
    below: float = 0.0
    """Distance [m] that the part reaches below its origin."""
    side: float = 0.0
    """Radius [m] of the upright round side by which it is turned over; 0 if it has none that is high enough."""
    other_grips: tuple[tuple[float, float], ...] = ()
    """Further places of the cup's middle, for parts at which the arm has no room for the first one."""

    @property
    def height(self) -> float:
        """Distance [m] that the part hangs below the cup."""
        return self.top + self.below

    @property
    def other_side(self) -> Pose:
        """Frame of the part with its other side up: in it the part looks as in its own frame before."""
        return Pose.from_rpy((0.0, 0.0, self.top - self.below), (math.pi, 0.0, 0.0))

    @property
    def extent(self) -> float:
        """Radius [m] of the circle about the origin that holds the part."""
        return max(math.hypot(disc.x, disc.y) + disc.radius for disc in self.outline)

    def covers(self, frame_T_part: Pose) -> tuple[Disc, ...]:
        """Return the discs of a part that lies at a pose, in the frame of that pose."""
        return discs_at(self.outline, *frame_T_part.position[:2], frame_T_part.yaw)


def discs_at(discs: Iterable[Disc], x: float, y: float, yaw: float) -> tuple[Disc, ...]:
    """Return discs of a frame at x, y [m] and yaw [rad] in the frame around it."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return tuple(Disc(x + cos * disc.x - sin * disc.y, y + sin * disc.x + cos * disc.y, disc.radius) for disc in discs)


def box_outline(length: float, width: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> tuple[Disc, ...]:
    """Return discs that cover a rectangle: `length` [m] along its own x, middle at x, y [m], turned by yaw [rad]."""
    if length < width:
        return box_outline(width, length, x, y, yaw + math.pi / 2)
    count = math.ceil(length / width)
    step = length / count
    radius = math.hypot(step / 2, width / 2)
    places = [step * (index - (count - 1) / 2) for index in range(count)]
    return tuple(Disc(x + math.cos(yaw) * place, y + math.sin(yaw) * place, radius) for place in places)


_PARTS = {
    # the cup meets the mark, 3 mm above the wheel
    "gear_part": PartFigures((0.0, 0.0), 0.015, (Disc(0.0, 0.0, 0.0392),)),
    # the mark is just outside the face
    "disk_part": PartFigures((-0.008, -0.008), 0.02316, (Disc(0.0, 0.0, 0.0627),)),
    # hollow in the middle: the face rests on both sides, the mark is outside
    "gasket_part": PartFigures(
        (-0.012, 0.0), 0.02, (Disc(0.067, 0.0, 0.028), Disc(-0.067, 0.0, 0.028), Disc(0.0, 0.0, 0.065))
    ),
    # the origin is in the head, the middle of mass on the rod
    "piston_rod_part": PartFigures(
        (0.0, 0.04),
        0.0075,
        (*box_outline(0.059, 0.052), *box_outline(0.031, 0.11, 0.0, 0.08)),
        other_grips=((0.0, 0.0), (0.0, 0.09)),
    ),
    "pulley_part": PartFigures((0.0, 0.0), 0.0724, (Disc(0.0, 0.0, 0.1125),), side=0.1125),
    "part1": PartFigures((0.0, 0.0), 0.0075, box_outline(0.3, 0.1), 0.0075),
    "part2": PartFigures((0.0, 0.0), 0.01, box_outline(0.06, 0.015)),
    "part3": PartFigures((0.03, 0.03), 0.02, box_outline(0.13, 0.07, 0.03, 0.03, 0.9)),
    "part4": PartFigures((0.0, 0.0), 0.005, box_outline(0.09, 0.06), 0.0052),
}


class Catalogue:
    """Part types that the agent can handle in one cell, and why it can't handle the others.

    Args:
        own: the trial's own part types, as `Client.part_types` returns them.
    """

    def __init__(self, own: Mapping[str, Mapping[str, Any]] | None = None) -> None:
        self._own = dict(own or {})
        self._known = dict(_PARTS)
        self._refused: dict[str, str] = {}
        self._turns: dict[str, Pose] = {}
        self._ordered: set[str] = set()
        self.max_extent = max(kind.extent for kind in _PARTS.values())
        """Largest distance [m] of a point of a part from its origin."""
        for name in self._own:
            self._choose_top(name, 0)

    def __contains__(self, part_type: object) -> bool:
        return part_type in self._known

    @property
    def types(self) -> list[str]:
        """Types that can be handled, by name."""
        return sorted(self._known)

    def figures(self, part_type: str) -> PartFigures:
        """Return the figures of a type.

        Raises:
            UnknownNameError: the type is unknown, or the agent can't handle it.
        """
        try:
            return self._known[part_type]
        except KeyError:
            raise UnknownNameError("part type", part_type, self._known) from None

    def why_not(self, part_type: str) -> str:
        """Return the reason why a type is not handled."""
        return self._refused.get(part_type, "its model is unknown")

    def note_order(self, part_type: str, tray_T_goal: Pose) -> None:
        """Take the upward side of an ordered part as the side by which its type is handled from now on.

        The first order of a type decides, for the agent turns no part over.
        """
        if part_type in self._own and part_type not in self._ordered:
            self._ordered.add(part_type)
            turns = [_turn(top) for top in self._own[part_type]["tops"]]
            ups = [(tray_T_goal @ turn).rotate((0.0, 0.0, 1.0))[2] for turn in turns]
            self._choose_top(part_type, max(range(len(ups)), key=ups.__getitem__))

    def turned(self, part_type: str, frame_T_part: Pose) -> Pose:
        """Return the pose of a part with z of its upward side as its z; types of 2017 stay as they are."""
        turn = self._turns.get(part_type)
        return frame_T_part if turn is None else frame_T_part @ turn

    def side_up(self, part_type: str, frame_T_part: Pose) -> tuple[Pose, bool]:
        """Return the pose of a part by the side that is up, and whether that is its other side.

        The part looks the same in both frames, so all figures hold for both. Only types that can be turned over have
        another side.
        """
        pose = self.turned(part_type, frame_T_part)
        kind = self._known.get(part_type)
        if kind is None or not kind.side or pose.rotate((0.0, 0.0, 1.0))[2] >= 0.0:
            return pose, False
        return pose @ kind.other_side, True

    def _choose_top(self, name: str, number: int) -> None:
        top = self._own[name]["tops"][number]
        self._turns[name] = _turn(top)
        self._known.pop(name, None)
        self._refused.pop(name, None)
        found = figures_of({"mass": self._own[name]["mass"], **top})
        if isinstance(found, str):
            self._refused[name] = found
        else:
            self._known[name] = found
        self.max_extent = max(kind.extent for kind in self._known.values())


def figures_of(values: Mapping[str, Any]) -> PartFigures | str:
    """Return the figures of a trial's own type with one side up, or why the agent can't handle it.

    `values` are those of that top in `Client.part_types`, and the mass.
    """
    mass, spots = values["mass"], values["spots"]
    wide = [spot for spot in spots if spot["radius"] >= MIN_SPOT]
    aside = [math.dist(spot["position"][:2], values["centre_of_mass"][:2]) for spot in wide]  # [m]
    usable = [spot for spot, away in zip(wide, aside, strict=True) if away * mass <= MAX_MOMENT]
    if not spots:
        return "it has no flat top for the cup"
    if not wide:
        widest = max(spot["radius"] for spot in spots)
        return f"its flat top is too small: a disc of {widest * 1e3:.0f} mm radius (needs {MIN_SPOT * 1e3:g} mm)"
    if mass > MAX_MASS:
        return f"it is too heavy: {mass:g} kg, the arm carries {MAX_MASS:g} kg"
    if not usable:
        return f"it would turn the wrist: its flat top is {min(aside) * 1e3:.0f} mm beside its centre of mass"
    x, y, top = usable[0]["position"]
    (x0, y0, bottom), (x1, y1, _) = values["lower"], values["upper"]
    if top - bottom > MAX_HEIGHT:
        return f"it is too tall: {(top - bottom) * 1e3:.0f} mm below the cup, {MAX_HEIGHT * 1e3:g} mm can be carried"
    middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
    disc = (Disc(middle_x, middle_y, values["radius"]),)
    row = box_outline(x1 - x0, y1 - y0, middle_x, middle_y)
    is_slim = len(row) * row[0].radius ** 2 < disc[0].radius ** 2
    return PartFigures((x, y), top, row if is_slim else disc, -bottom)


def _turn(top: Mapping[str, Any]) -> Pose:
    """part_T_top."""
    w, x, y, z = top["turn"]
    return Pose((0.0, 0.0, 0.0), (w, x, y, z))
