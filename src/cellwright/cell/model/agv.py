"""AGVs and their trays."""

from typing import Any

import mujoco

from cellwright.cell.model.tray import RIM_TOP, fill_tray
from cellwright.config.layout.layout import Carrier
from cellwright.engine import colours
from cellwright.engine.shapes import Colour, Role, Visuals, add_shape, at, box, cylinder
from cellwright.util.pose import Pose, Vector3

AGV_MASS = 50.0
"""Mass [kg] of an AGV without its tray."""

DRIVE_MASS = 2e4
"""Inertia [kg] that the gears of its drives add to an AGV: a push or a kit does not move it noticeably."""

STIFFNESS, DAMPING = DRIVE_MASS * 30.0**2, DRIVE_MASS * 30.0
"""Gains of an AGV's drives [N/m], [N s/m]: 30 rad/s, half of critical damping.

Stiffer is not better. The engine damps a drive implicitly, but computes the friction under the kit with the drive's
force at the start of the step. While the AGV accelerates, the kit therefore creeps ahead of the tray in proportion to
damping times timestep over mass. On the way to 0.5 m/s it creeps 0.06 mm with these figures. With a damping of 1e5 on
the bare mass of the AGV it creeps 4 mm.
"""


def add_agv(spec: Any, visuals: Visuals, carrier: Carrier) -> None:
    """Add an AGV at home, on two slides along the axes of its path whose positions [m] count from there.

    The drives are `pid` actuators `<agv>_x` and `<agv>_y` with position and velocity inputs. By default a tree with
    actuators never sleeps, nor does anything on it; this one is allowed to.
    """
    agv, home = carrier.name, carrier.home
    body = spec.worldbody.add_body(name=agv, pos=home.position, quat=home.quaternion)
    body.sleep = mujoco.mjtSleepPolicy.mjSLEEP_ALLOWED
    axes: tuple[tuple[str, Vector3], ...] = tuple(zip("xy", carrier.axes, strict=True))
    for name, axis in axes:
        local = home.inverse().rotate(axis)
        slide = body.add_joint(name=f"{agv}_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=local)
        slide.armature = DRIVE_MASS
        drive = spec.add_actuator(name=f"{agv}_{name}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=f"{agv}_{name}")
        drive.set_to_pid(kp=STIFFNESS, kv=DAMPING)
    _fill_agv(body, visuals, carrier.colour)
    tray = body.add_body(name=carrier.tray_link, pos=carrier.home_T_tray.position)
    fill_tray(tray, visuals, carrier, carrier.surface - carrier.home_T_tray.position[2], RIM_TOP)


def _fill_agv(body: Any, visuals: Visuals, colour: Colour) -> None:
    """Add chassis, bumper, mast and column; the tray is in front of the column, at local +y."""
    add_shape(body, box(0.555, 1.023, 0.409, at(z=0.3045), colour, 1.0), Role.BOTH, mass=AGV_MASS)
    add_shape(body, box(0.673, 1.171, 0.124, at(z=0.162), colours.BLACK), Role.BOTH)
    add_shape(body, cylinder(0.087, 0.875, at(0.0, -0.275, 0.4375), colours.STEEL_LIGHT), Role.BOTH)
    add_shape(body, cylinder(0.043, 1.408, at(0.0, -0.275, 0.704), colours.STEEL_DARK), Role.BOTH)
    visuals.add(
        body.name,
        cylinder(0.05, 0.04, at(0.0, -0.275, 1.42), colour),
        box(0.22, 0.34, 0.24, at(0.0, 0.15, 0.62), colours.STEEL_DARK),
        box(0.56, 0.62, 0.006, at(0.0, 0.15, 0.511), colours.RUBBER),
    )
    for side in (1.0, -1.0):
        visuals.add(body.name, box(0.557, 0.03, 0.06, at(0.0, 0.4975 * side, 0.42), colours.WHITE))
        for y in (-0.36, 0.0, 0.36):
            radius = 0.1 if y == 0.0 else 0.07
            wheel = Pose.from_rpy((0.29 * side, y, radius), (0.0, 1.5708, 0.0))
            visuals.add(
                body.name,
                cylinder(radius, 0.05, wheel, colours.RUBBER),
                cylinder(radius * 0.5, 0.054, wheel, colours.STEEL_LIGHT),
            )
