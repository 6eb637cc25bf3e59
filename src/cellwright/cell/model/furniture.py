"""Fixed bodies of the cell: floor, bins, conveyor, frames, shelf, deletion wall, and housings of sensors.

Surfaces that parts lie on are thick solids: a part that falls from a metre moves 9 mm in a step of 2 ms.
"""

import math
from typing import Any

import mujoco

from cellwright.cell.model import frames
from cellwright.config.layout import REFERENCE_FRAMES
from cellwright.config.trial.trial import PictureCameraConfig, SensorConfig
from cellwright.engine import colours
from cellwright.engine.shapes import HERE, Colour, Role, Shape, Visuals, add_shape, at, box, capsule, cylinder
from cellwright.util.pose import Pose

_LENS_FORWARD = (0.0, 1.5708, 0.0)
"""Turn of a cylinder's axis from z to x, the viewing direction of a sensor."""
BELT_GEOM = "conveyor_belt"
"""Geom with the moving surface."""
DELETION_WALL_GEOM = "deletion_wall"
"""Geom that removes the parts that touch it."""
SHELF_BODY = "shelf"


def add_housing(visuals: Visuals, sensor: SensorConfig) -> None:
    """Add the housing of a sensor at its pose; that of a camera moves with the body it is fixed to."""
    housing: tuple[Shape, ...]
    if isinstance(sensor, PictureCameraConfig):
        # all of it is behind the optical centre, which is at the pose
        housing = _cube(-0.014, 0.024, 0.09, 0.026), _lens(0.009, -0.007, colours.SENSOR_LENS)
    else:
        housing = _housing(sensor.type)
    body = sensor.frame if isinstance(sensor, PictureCameraConfig) else "world"
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


def add_floor(spec: Any, visuals: Visuals) -> None:
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
    line, height = 0.08, 0.002
    for side in (1.0, -1.0):
        visuals.add(
            "world",
            box(2.3, line, height, at(0.3, 2.45 * side, height / 2), colours.LINE_YELLOW),
            box(2.3, line, height, at(0.3, 4.15 * side, height / 2), colours.LINE_YELLOW),
            box(line, 1.78, height, at(1.41, 3.3 * side, height / 2), colours.LINE_YELLOW),
        )
    visuals.add(
        "world",
        box(line, 8.6, height, at(-1.75, 0.0, height / 2), colours.LINE_YELLOW),
        box(line, 16.0, height, at(2.35, 3.0, height / 2), colours.LINE_YELLOW),
    )


def add_bins(spec: Any, visuals: Visuals) -> None:
    """Add the eight bins; the open sides of each face world +x and -x."""
    for name in frames.BIN_CENTRES:
        frame = REFERENCE_FRAMES[f"{name}::link"]
        body = spec.worldbody.add_body(name=name, pos=frame.position, quat=frame.quaternion)
        _fill_bin(body, visuals)


def _fill_bin(body: Any, visuals: Visuals) -> None:
    """Add one bin in the frame of its model, in which the closed sides are at +-x, the open ones at +-y.

    Base and sills are visual only: nothing gets there, and every collision shape costs time in each step.
    """
    # inner half width, walls (grown outward), height of their upper edge
    inner, thick, rim = 0.3175, 0.008, 0.79089
    corner, middle, sill, base = 0.134, 0.372, 0.50569, 0.2005
    # solid from half height on: nothing tunnels through a floor of this thickness
    floor = 0.225
    add_shape(
        body, box(2 * inner, 2 * inner, floor, at(z=frames.BIN_SURFACE - floor / 2), colours.BIN_FLOOR), Role.BOTH
    )
    foot = box(0.668, 0.668, base - 0.08, at(z=(base + 0.08) / 2), colours.STEEL_DARK)
    visuals.add(body.name, foot)
    outer = inner + thick / 2
    for side in (1.0, -1.0):
        _add_wall(body, Pose.from_rpy((outer * side, 0.0, 0.0), (0.0, 0.0, math.pi / 2)), 2 * inner, thick, base, rim)
        for end in (1.0, -1.0):
            x = (inner + thick - corner / 2) * end
            _add_wall(body, at(x, outer * side), corner, thick, base, rim)
            wheel = Pose.from_rpy((0.26 * side, 0.26 * end, 0.05), (math.pi / 2, 0.0, 0.0))
            visuals.add(body.name, cylinder(0.05, 0.03, wheel, colours.RUBBER))
        visuals.add(body.name, box(middle, thick, sill - base, at(0.0, outer * side, (sill + base) / 2), colours.BIN))


def _add_wall(body: Any, foot: Pose, length: float, thick: float, bottom: float, top: float) -> None:
    """Add a wall along x of `foot` with a rounded upper edge.

    Between a flat part and the narrow flat top of a box the engine sometimes finds a contact that points sideways.
    """
    radius = thick / 2
    shoulder = top - radius
    plate = box(length, thick, shoulder - bottom, foot @ at(z=(shoulder + bottom) / 2), colours.BIN)
    edge = foot @ Pose.from_rpy((0.0, 0.0, shoulder), (0.0, math.pi / 2, 0.0))
    add_shape(body, plate, Role.BOTH)
    add_shape(body, capsule(radius, length - thick, edge, colours.BIN), Role.BOTH)


def add_conveyor(spec: Any, visuals: Visuals) -> None:
    """Add the conveyor. Its belt stands still; the surface of the geom `conveyor_belt` moves along its local +x."""
    length, width, thickness = frames.CONVEYOR_SIZE
    body = spec.worldbody.add_body(
        name=BELT_GEOM, pos=frames.CONVEYOR_CENTRE.position, quat=frames.CONVEYOR_CENTRE.quaternion
    )
    # no effect on a fixed body, but without any the engine would ignore that of gliding parts
    body.gravcomp = 1.0
    add_shape(body, box(length, width, thickness, HERE, colours.BELT), Role.BOTH, name=BELT_GEOM)
    surface = frames.BELT_SURFACE - frames.CONVEYOR_CENTRE.position[2]
    for side in (1.0, -1.0):
        visuals.add(
            BELT_GEOM,
            box(length, 0.02, 0.15, at(0.0, (width / 2 + 0.011) * side, surface - 0.08), colours.BELT_EDGE),
            box(length, 0.012, 0.0006, at(0.0, (width / 2 - 0.02) * side, surface), colours.STEEL_LIGHT),
            *(box(0.06, 0.06, 0.72, at(2.1 * k, 0.27 * side, -0.4526), colours.STEEL_DARK) for k in range(-3, 4)),
        )
    for end in (1.0, -1.0):
        drum = Pose.from_rpy((length / 2 * end, 0.0, 0.0), (math.pi / 2, 0.0, 0.0))
        visuals.add(BELT_GEOM, cylinder(thickness / 2, width, drum, colours.RUBBER))


def add_frames(spec: Any, visuals: Visuals) -> None:
    """Add two portals over the bins and a fence along the conveyor: posts and bars for sensors, which an arm can hit.

    They have the yaw of the original's workcell, which is rounded to 1.57. Each is a flat body of its own: the arm is
    first tested against its bounding box.
    """
    thick = 0.05

    def add_body(name: str, x: float, z: float = 0.0) -> Any:
        frame = frames.WORKCELL @ at(x=x, z=z)
        return spec.worldbody.add_body(name=name, pos=frame.position, quat=frame.quaternion)

    for number, x in enumerate((-1.08, -0.3143), 1):
        portal = add_body(f"camera_frame_{number}", x)
        add_shape(portal, box(thick, 3.5, thick, at(y=-0.25, z=2.0), colours.FRAME), Role.BOTH)
        for y in (-2.0, 1.5):
            add_shape(portal, box(thick, thick, 1.975, at(y=y, z=0.9875), colours.FRAME), Role.BOTH)
    fence = add_body("conveyor_frame", 1.7)
    add_shape(fence, box(thick, 10.0, thick, at(z=0.95), colours.FRAME), Role.BOTH)
    for y in range(-5, 6):
        add_shape(fence, box(thick, thick, 3.0, at(y=float(y), z=1.5), colours.FRAME), Role.BOTH)
    beam = add_body("conveyor_beam", 1.21, 3.0)
    add_shape(beam, box(thick, 10.0, thick, HERE, colours.FRAME), Role.BOTH)
    for y in (-5.0, 0.0, 5.0):
        visuals.add("world", box(0.54, thick, thick, frames.WORKCELL @ at(1.455, y, 3.0), colours.FRAME))


def add_shelf(spec: Any, slots: int) -> None:
    """Add the shelf, far from the cell, with room for `slots` parts that wait or are out of play."""
    side = frames.SHELF_PITCH * (frames.shelf_columns(slots) + 1)
    body = spec.worldbody.add_body(name=SHELF_BODY, pos=(*frames.SHELF_CENTRE, 0.0))
    add_shape(body, box(side, side, frames.SHELF_SURFACE, at(z=frames.SHELF_SURFACE / 2), colours.STEEL), Role.BOTH)


def add_deletion_wall(spec: Any) -> None:
    """Add the invisible, contact-free space at the end of the belt in which parts leave the cell."""
    spec.worldbody.add_geom(
        name=DELETION_WALL_GEOM,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.5, 0.05, 0.5),
        pos=frames.DELETION_WALL,
        group=int(Role.UNSEEN),
        contype=0,
        conaffinity=0,
    )
