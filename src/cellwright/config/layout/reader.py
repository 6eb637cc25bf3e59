"""Reader of the section `cell`: YAML to a `Layout`.

The section is first joined with what it is based on, as trees that know their lines. So each mistake is reported where
it is written, and the 2017 cell is read like any other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any

from cellwright.config.layout import keys
from cellwright.config.layout.arm_models import ArmModel
from cellwright.config.layout.arm_reader import read_arms
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.basing import BASED_ON, GEAR2017, PACKAGED, with_base
from cellwright.config.layout.layout import Belt, Bin, Carrier, KeyFrames, Layout, Tray
from cellwright.config.layout.names import NAMED_SECTIONS, PLACE_SECTIONS, NameCheck
from cellwright.config.layout.robot_reader import read_robots
from cellwright.config.layout.robots import robot_links
from cellwright.config.layout.surroundings import Place, Structure, View
from cellwright.config.layout.values import Named, placed, turned
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Table
from cellwright.config.robot.config import RobotConfig
from cellwright.util.pose import Pose

SHELF = Pose((1.0, -40.0, 0.0))
"""Default place of the shelf: far from the cell, and in line with it."""

_GRID_ABOVE, _FRAME_BELOW = 0.025, 0.005
"""Height of a bin's grids above its surface, and of its frame below it [m]."""
_SPAWN_AFTER, _WALL_BEFORE = 0.3, 0.2
"""Distance of the place where parts appear from a belt's start, and of its wall from its end [m]."""
_WAY_OUT, _WAY_TIME = 5.0, "10"
"""Default way of a carrier: straight out at its -y [m], and the time of a way [s]."""
_QUALITY = Pose.from_rpy((0.0, -0.2, 1.5), (0.0, math.pi / 2, math.pi / 2))
"""Default pose of the quality control sensor in the frame of its carrier, as in 2017."""
_TOLERANCE = 1e-3
"""Distance to which a carrier's path has to meet its station and itself [m]."""
_BIN = ("size", "grid_height", "walls", "open", "gap")
_BELT = {"width": 0.65, "surface": 0.9, "thickness": 0.18862, "speed": 0.2}
"""Defaults of a belt: width, height of the surface, thickness [m], speed [m/s]."""
_ANGLE = 0.8
"""Default vertical opening angle of a view [rad]."""
_NUMBERED = re.compile(r"agv[1-9]\d?", re.ASCII)
_DIGITS = 12
"""Digits of heights and directions that are computed: so a quarter turn leaves no 6e-17 of the other axis."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Section `cell`, as read.

    Attributes:
        layout: the layout, in the frame of the cell.
        moved_by: pose of the cell's frame in the world, by which the reader of the whole trial moves it.
        has_arm: True if the file's own section places an arm, without which the trial decides.
        arm_models: models of the arms that have their own, by name.
        robot_models: configurations of the robots, by name.
        sensors: the section `sensors` with what it is based on; None if there is none.
        refused: names of entries that were refused: what refers to them needs no report.
    """

    layout: Layout
    moved_by: Pose = field(default_factory=Pose)
    has_arm: bool = False
    arm_models: Mapping[str, ArmModel] = field(default_factory=dict)
    robot_models: Mapping[str, RobotConfig] = field(default_factory=dict)
    sensors: Table | None = None
    refused: frozenset[str] = frozenset()


def read_cell(own: Table, reader: Reader, types: Collection[str] = ()) -> Cell | None:
    """Return the cell that a section describes, without what was refused; None if its base was refused.

    Args:
        own: the section.
        reader: receives every mistake.
        types: part types, whose names nothing else may have.
    """
    section = with_base(own, reader)
    if section is None:
        return None
    values = keys.CELL.read(section, reader)
    named: Sequence[Named] = values.get("arms", ())
    if "arm_clearance" in values and (not named or len(named) + len(values.get("robots", ())) < 2):
        message = "the cell has no two arms, nor an arm and a robot; leave it out"
        reader.problems.error(section.entries["arm_clearance"], message)
    robots, configs = read_robots(values.get("robots", ()), reader)
    links = {robot.name: robot_links(robot, configs[robot.name]) for robot in robots}
    arms, models = read_arms(named, reader, links)
    layout = replace(_layout(values, arms, reader), robots=robots)
    _check_names(section, reader, types)
    if not any(name in section.entries for name in NAMED_SECTIONS):
        message = f"the cell is empty; describe bins and belts, or begin from 2017's with {BASED_ON}: {GEAR2017}"
        reader.problems.warn(own, message)
    sensors = section.get("sensors")
    read = {each.name for part in (layout.bins, layout.belts, layout.carriers, layout.trays) for each in part}
    return Cell(
        layout=layout,
        moved_by=values.get("frame", Pose()),
        has_arm=any(each.entry.place.path != PACKAGED for each in named),
        arm_models=models,
        robot_models=configs,
        sensors=sensors if isinstance(sensors, Table) else None,
        refused=_names(section) - read,
    )


def _names(section: Table) -> frozenset[str]:
    """Return all names in the sections of places."""
    tables = (section.get(name) for name in PLACE_SECTIONS)
    return frozenset(str(name) for table in tables if isinstance(table, Table) for name in table.entries)


def _layout(values: dict[str, Any], arms: tuple[Arm, ...], reader: Reader) -> Layout:
    carriers = _carriers(values.get("carriers", ()), reader)
    first = max((each.number for each in carriers), default=0) + 1
    return Layout(
        frame=Pose(),
        bins=tuple(_bin(each) for each in values.get("bins", ())),
        belts=tuple(belt for each in values.get("belts", ()) if (belt := _belt(each, reader))),
        carriers=carriers,
        arms=arms,
        shelf=values.get("shelf", SHELF),
        arm_clearance=values.get("arm_clearance"),
        trays=tuple(_tray(number, each) for number, each in enumerate(values.get("trays", ()), first)),
        structure=(
            *(_structure(each) for each in values.get("structure", ())),
            *(found for arm in arms if (found := arm.mount.structure(f"{arm.name}_{arm.mount.kind}"))),
        ),
        floor_lines=values.get("floor_lines", ()),
        views=tuple(_view(each) for each in values.get("views", ())),
        places=tuple(Place(each.name, turned(**each.values)) for each in values.get("places", ())),
    )


def _bin(each: Named) -> Bin:
    """Return a bin. Its model may be turned against its grids, as in 2017."""
    at, turn = each.values["at"], each.values.get("turn", 0.0)
    more: dict[str, Any] = {key: each.values[key] for key in _BIN if key in each.values}
    if "surface" in each.values:
        surface = each.values["surface"]
        heights = {"grid_height": round(surface + _GRID_ABOVE, _DIGITS)}
        more = {**heights, **more, "surface": surface, "frame_height": round(surface - _FRAME_BELOW, _DIGITS)}
    return Bin(each.name, placed(at, turn), placed(at, turn + each.values.get("model_turn", 0.0)), **more)


def _tray(number: int, each: Named) -> Tray:
    values = dict(each.values)
    return Tray(number, each.name, placed(values.pop("at"), values.pop("turn", 0.0)), **values)


def _structure(each: Named) -> Structure:
    """Return a structure, whose place may be given in a frame of its own."""
    values, pose = each.values, turned(each.values["at"], each.values.get("turn", 0.0))
    frame = values.get("frame")
    return Structure(each.name, pose if frame is None else frame @ pose, values["boxes"], values.get("drawn", ()))


def _view(each: Named) -> View:
    return View(each.name, each.values["at"], each.values["to"], each.values.get("angle", _ANGLE))


def _belt(each: Named, reader: Reader) -> Belt | None:
    line = _belt_line(each, reader)
    if line is None:
        return None
    (x, y), turn, length = line
    values = each.values
    surface, thickness, width = (values.get(key, _BELT[key]) for key in ("surface", "thickness", "width"))
    centre = turned((x, y, round(surface - thickness / 2, _DIGITS)), turn)
    drops, wall = values.get("ends") == keys.DROP, values.get("wall", {})
    if drops and "wall" in each.table:
        reader.problems.error(each.table.entries["wall"], "parts drop off this belt's end; leave out ends or wall")
    end = centre.transform((length / 2 - _WALL_BEFORE, 0.0, 0.0))
    wall_at = wall.get("at", (end[0], end[1], surface + 0.5))
    return Belt(
        name=each.name,
        body="conveyor_belt" if each.name == "belt" else f"conveyor_{each.name}",
        centre=centre,
        size=(length, width, thickness),
        speed=values.get("speed", _BELT["speed"]),
        direction=(round(math.cos(turn), _DIGITS) + 0.0, round(math.sin(turn), _DIGITS) + 0.0, 0.0),
        spawn=values.get("spawn", centre @ Pose((_SPAWN_AFTER - length / 2, 0.0, 0.0))),
        frame=values.get("frame", turned((x, y, surface), turn)),
        wall=None if drops else turned(wall_at, wall.get("turn", turn + math.pi / 2)),
        wall_size=wall.get("size", (width + 0.1, 0.1, 1.0)),
    )


def _belt_line(each: Named, reader: Reader) -> tuple[tuple[float, float], float, float] | None:
    """Return the middle, the direction and the length of a belt, from `from` and `to`, or from `at` and `length`."""
    values, ends, middle = each.values, {"from", "to"} & each.table.entries.keys(), {"at", "turn", "length"}
    middle &= each.table.entries.keys()
    if ends and middle:
        found = " and ".join(sorted(map(str, ends | middle)))
        reader.problems.error(each.entry, f"write from and to, or at, turn and length (got {found})")
        return None
    missing = sorted({"from", "to"} - ends if ends or not middle else {"at", "length"} - middle)
    if missing:
        message = f"the required entry {missing[0]!r} is missing; a belt has from and to, or at, turn and length"
        reader.problems.error(each.entry, message)
        return None
    if not ends:
        at, length = values.get("at"), values.get("length")
        return None if at is None or length is None else (at, values.get("turn", 0.0), length)
    start, end = values.get("from"), values.get("to")
    if start is None or end is None:
        return None
    length = math.dist(start, end)
    if not keys.MIN_BELT <= length <= keys.MAX_BELT:
        message = f"must be from {keys.MIN_BELT:g} to {keys.MAX_BELT:g} m long (got {length:g}, from start to end)"
        reader.problems.error(each.entry, message)
        return None
    middle_point = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    return middle_point, math.atan2(end[1] - start[1], end[0] - start[0]), length


def _carriers(found: Sequence[Named], reader: Reader) -> tuple[Carrier, ...]:
    """Return the carriers. The number of `agv2` is 2; others get those that are left, in their order."""
    numbers = {each.name: int(each.name[3:]) for each in found if _NUMBERED.fullmatch(each.name)}
    free = (number for number in count(1) if number not in numbers.values())
    for each in found:
        if each.name not in numbers:
            numbers[each.name] = next(free)
    return tuple(carrier for each in found if (carrier := _carrier(each, numbers[each.name], reader)))


def _carrier(each: Named, number: int, reader: Reader) -> Carrier | None:
    values, home = each.values, placed(each.values["at"], each.values.get("turn", 0.0))
    path = values.get("path") or _straight_path(home)
    if not _joins(each, home, path, reader):
        return None
    tray = f"kit_tray_{number}"
    carrier = Carrier(
        number=number,
        name=each.name,
        home=home,
        tray_link=f"{each.name}::{tray}::{tray}::tray",
        tray_frame=home,
        quality=home @ _QUALITY,
        out=path["out"],
        back=path["back"],
    )
    plate = values.get("tray", carrier.plate)
    if any(edge > most for edge, most in zip(plate, keys.MAX_TRAY, strict=True)):
        most, got = (" x ".join(f"{edge:g}" for edge in edges) for edges in (keys.MAX_TRAY, plate))
        message = f"must be at most {most} m, which the quality control sensor sees (got {got})"
        reader.problems.error(each.table.entries["tray"].value, message)
    # a longer tray reaches further to the front, since the mast is behind it; so its sensor is further in front, too
    longer = max(0.0, plate[1] - carrier.plate[1])
    home_T_tray = Pose((0.0, longer / 2, 0.0)) @ carrier.home_T_tray
    return replace(
        carrier,
        colour=values.get("colour", carrier.colour),
        plate=plate,
        home_T_tray=home_T_tray,
        tray_frame=values.get("tray_frame", home @ home_T_tray),
        quality=values.get("quality_sensor", home @ Pose((0.0, longer, 0.0)) @ _QUALITY),
    )


def _straight_path(home: Pose) -> dict[str, KeyFrames]:
    (x, y, _), (far_x, far_y, _) = home.position, home.transform((0.0, -_WAY_OUT, 0.0))
    far_x, far_y = round(far_x, _DIGITS), round(far_y, _DIGITS)
    return {"out": (("0", x, y), (_WAY_TIME, far_x, far_y)), "back": (("0", far_x, far_y), (_WAY_TIME, x, y))}


def _joins(each: Named, home: Pose, path: dict[str, KeyFrames], reader: Reader) -> bool:
    """Return whether the ways join each other and the station; report it if they do not."""
    station, out, back = home.position[:2], path["out"], path["back"]
    ends = (
        ("the way out must begin at the station", station, out[0]),
        ("the way back must begin where the way out ends", out[-1][1:], back[0]),
        ("the way back must end at the station", station, back[-1]),
    )
    joined = True
    for text, wanted, (_, x, y) in ends:
        if math.dist(wanted, (x, y)) > _TOLERANCE:
            where = each.table.entries.get("path", each.entry)
            wanted_text = f"[{wanted[0]:g}, {wanted[1]:g}]"
            reader.problems.error(where, f"{text}, {wanted_text} (got [{x:g}, {y:g}])")
            joined = False
    return joined


def _check_names(section: Table, reader: Reader, types: Collection[str]) -> None:
    """Refuse names that two things have, or that the cell has for something else."""
    check = NameCheck(reader, types)
    for name in NAMED_SECTIONS:
        table = section.get(name)
        for entry in table.entries.values() if isinstance(table, Table) else ():
            if isinstance(entry.name, str):
                check.admit(entry, entry.name, name)
