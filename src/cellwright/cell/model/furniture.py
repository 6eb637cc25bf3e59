"""Fixed bodies of the cell: floor, conveyor, structure, shelf, deletion wall, and housings of sensors.

Surfaces that parts lie on are thick solids: a part that falls from a metre moves 9 mm in a step of 2 ms.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco

from cellwright.cell.model import shelf
from cellwright.config.layout.layout import Belt, Layout
from cellwright.config.layout.surroundings import Structure
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.engine import colours
from cellwright.engine.shapes import HERE, Colour, Role, Shape, Visuals, add_shape, at, box, cylinder
from cellwright.util.pose import Pose

_LENS_FORWARD = (0.0, 1.5708, 0.0)
"""Turn of a cylinder's axis from z to x, the viewing direction of a sensor."""
SHELF_BODY = "shelf"
_LEG_PITCH = 2.1
"""Distance [m] between the legs of a long belt."""
_LINE_HEIGHT = 0.002


def add_housing(visuals: Visuals, sensor: SensorConfig, links: Mapping[str, str]) -> None:
    """Add the housing of a sensor at its pose; that of a camera moves with the link whose frame it is fixed to."""
    housing: tuple[Shape, ...]
    if isinstance(sensor, PictureCameraConfig):
        # all of it is behind the optical centre, which is at the pose
        housing = _cube(-0.014, 0.024, 0.09, 0.026), _lens(0.009, -0.007, colours.SENSOR_LENS)
    else:
        housing = _housing(sensor.type)
    body = links.get(sensor.frame, "world") if isinstance(sensor, PictureCameraConfig) else "world"
    visuals.add(body, *(shape.moved(sensor.pose) for shape in housing))


def _housing(sensor_type: str) -> tuple[Shape, ...]:
    match sensor_type:
        case "break_beam":
            return _cube(-0.025, 0.05, 0.03, 0.05), _lens(0.009, 0.002, colours.SENSOR_BEAM)
        case "proximity_sensor":
            barrel = cylinder(0.015, 0.06, Pose.from_rpy((-0.03, 0.0, 0.0), _LENS_FORWARD), colours.STEEL_LIGHT)
            return barrel, _lens(0.0145, 0.002, colours.SENSOR_LENS)
        case "logical_camera":
            return _cube(-0.055, 0.11, 0.07, 0.07), _lens(0.026, 0.005, colours.SENSOR_LENS)
        case "laser_profiler":
            slit = box(0.004, 0.09, 0.012, at(x=0.006, z=0.06), colours.SENSOR_BEAM)
            return box(0.07, 0.12, 0.1, at(x=-0.03, z=0.06), colours.SENSOR), slit
        case _:
            return _cube(-0.03, 0.06, 0.06, 0.06), _lens(0.02, 0.002, colours.SENSOR_LENS)


def _cube(x: float, length: float, width: float, height: float) -> Shape:
    return box(length, width, height, at(x=x), colours.SENSOR)


def _lens(radius: float, x: float, colour: Colour) -> Shape:
    return cylinder(radius, 0.012, Pose.from_rpy((x, 0.0, 0.0), _LENS_FORWARD), colour)


def add_floor(spec: Any, visuals: Visuals, layout: Layout) -> None:
    """Add the infinite floor at height 0, with lines where people and AGVs go."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),  # a plane of size 0 is infinite
        rgba=colours.FLOOR,
        group=int(Role.BOTH),
        contype=1,
        conaffinity=0,
    )
    for line in layout.floor_lines:
        length, width = line.size
        visuals.add(
            "world", box(length, width, _LINE_HEIGHT, line.middle @ at(z=_LINE_HEIGHT / 2), colours.LINE_YELLOW)
        )


def add_conveyor(spec: Any, visuals: Visuals, belt: Belt) -> None:
    """Add a conveyor. Its belt stands still; the surface of the geom, named as the body, moves along its local +x."""
    length, width, thickness = belt.size
    body = spec.worldbody.add_body(name=belt.body, pos=belt.centre.position, quat=belt.centre.quaternion)
    # no effect on a fixed body, but without any the engine would ignore that of gliding parts
    body.gravcomp = 1.0
    add_shape(body, box(length, width, thickness, HERE, colours.BELT), Role.BOTH, name=belt.body)
    surface = belt.surface - belt.centre.position[2]
    for side in (1.0, -1.0):
        visuals.add(
            belt.body,
            box(length, 0.02, 0.15, at(0.0, (width / 2 + 0.011) * side, surface - 0.08), colours.BELT_EDGE),
            box(length, 0.012, 0.0006, at(0.0, (width / 2 - 0.02) * side, surface), colours.STEEL_LIGHT),
            *_legs(belt, side),
        )
    for end in (1.0, -1.0):
        drum = Pose.from_rpy((length / 2 * end, 0.0, 0.0), (math.pi / 2, 0.0, 0.0))
        visuals.add(belt.body, cylinder(thickness / 2, width, drum, colours.RUBBER))


def add_structure(spec: Any, visuals: Visuals, each: Structure) -> None:
    """Add a structure: a body with its solid boxes; those that are only drawn stand in the world."""
    if each.boxes:
        body = spec.worldbody.add_body(name=each.name, pos=each.pose.position, quat=each.pose.quaternion)
        for block in each.boxes:
            add_shape(body, box(*block.size, block.middle, colours.FRAME), Role.BOTH)
    visuals.add("world", *(box(*block.size, each.pose @ block.middle, colours.FRAME) for block in each.drawn))


def add_shelf(spec: Any, slots: int, layout: Layout) -> None:
    """Add the shelf, far from the cell, with room for `slots` parts that wait or are out of play."""
    side = shelf.SHELF_PITCH * (shelf.shelf_columns(slots) + 1)
    body = spec.worldbody.add_body(name=SHELF_BODY, pos=layout.shelf.position, quat=layout.shelf.quaternion)
    add_shape(body, box(side, side, shelf.SHELF_SURFACE, at(z=shelf.SHELF_SURFACE / 2), colours.STEEL), Role.BOTH)


def wall_name(belt: Belt) -> str:
    """Return the name of the geom that removes the parts that touch it."""
    return "deletion_wall" if belt.body == "conveyor_belt" else f"deletion_wall_{belt.body}"


def _legs(belt: Belt, side: float) -> Iterator[Shape]:
    """Yield the legs on one side of a belt: a row with at most 2.1 m between them, from the floor to its frame."""
    half, width, middle = max(belt.size[0] / 2 - 0.3, 0.06), belt.size[1], belt.centre.position[2]
    count = max(1, int(half / _LEG_PITCH))
    pitch = min(_LEG_PITCH, half / count)
    height = round(middle - 0.0926, 4)
    if height <= 0:
        return
    for number in range(-count, count + 1):
        foot = at(pitch * number, round(width / 2 - 0.0573, 3) * side, round(height / 2 - middle, 4))
        yield box(0.06, 0.06, height, foot, colours.STEEL_DARK)


def add_deletion_wall(spec: Any, belt: Belt, wall: Pose) -> None:
    """Add the invisible, contact-free space at the end of the belt in which parts leave the cell."""
    spec.worldbody.add_geom(
        name=wall_name(belt),
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=tuple(edge / 2 for edge in belt.wall_size),
        pos=wall.position,
        quat=wall.quaternion,
        group=int(Role.UNSEEN),
        contype=0,
        conaffinity=0,
    )
