"""Small whole cells for tests, and listeners for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import (
    BeltPart,
    CellSettings,
    DropRegion,
    Kit,
    KitObject,
    Options,
    Order,
    Part,
    Trial,
)
from cellwright.engine.clock import NANOSECONDS, nanoseconds
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from cellwright.middleware.messages.standard import JointTrajectory
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.util.pose import Pose

TRAY_1 = "agv1::kit_tray_1::kit_tray_1::tray"
TRAY_2 = "agv2::kit_tray_2::kit_tray_2::tray"

JOINTS = (
    "linear_arm_actuator_joint",
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
"""Names in the order of the controller."""

INITIAL = (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
"""Start posture of the arm [m, rad], in the order of the controller (ARIAC 2017)."""

ON_THE_ROD = dict(zip(JOINTS, (0.25, 3.2, -0.47, 2.09, 3.1, -1.51, 0.0), strict=True))
"""The lesson's first picking posture: the cup stands on the rod of `ROD_IN_REACH`."""

ABOVE_THE_ROD = (0.25, 3.2, -1.0, 2.5, 3.0, -1.51, 0.0)
"""The lesson's posture after picking, in the order of the controller: 0.27 m higher."""

ROD_IN_REACH = Part(
    "bin7|piston_rod_part_5", "piston_rod_part", Pose.from_rpy((-0.3, 0.03, 0.725), (0, 0, math.pi / 4))
)

GEARS = (KitObject("gear_part", Pose((0.1, 0.1, 0.0))), KitObject("gear_part", Pose((-0.1, 0.1, 0.0))))
"""Two gears, side by side on the tray."""


def order(number: int = 0, objects: tuple[KitObject, ...] = GEARS, **condition: Any) -> Order:
    """Return an order of one kit; announced at the start if no other condition is given."""
    name = f"order_{number}"
    return Order(name, (Kit(f"{name}_kit_0", objects),), **(condition or {"start_time": 0.0}))


def on_tray(*objects: KitObject, number: int = 1, first: int = 1, height: float = 0.006) -> tuple[Part, ...]:
    """Return parts at their places in a kit on the tray of an AGV."""
    return tuple(
        Part(f"tray{number}|{each.type}_{index}", each.type, _raised(each.pose, height), (TRAY_1, TRAY_2)[number - 1])
        for index, each in enumerate(objects, start=first)
    )


def _raised(pose: Pose, height: float) -> Pose:
    return Pose((*pose.position[:2], height), pose.quaternion)


SENSORS = (
    SensorConfig("break_beam_1", "break_beam", Pose.from_rpy((1.6, 2.25, 0.91), (0.0, 0.0, math.pi))),
    SensorConfig("proximity_sensor_1", "proximity_sensor", Pose((0.95, 2.6, 0.92))),
    SensorConfig(
        "laser_profiler_1", "laser_profiler", Pose.from_rpy((1.21, 4.0, 1.64), (-math.pi, math.pi / 2, math.pi / 2))
    ),
    SensorConfig("logical_camera_1", "logical_camera", Pose.from_rpy((-0.3, 0.23, 1.4), (0.0, math.pi / 2, 0.0))),
    SensorConfig("logical_camera_2", "logical_camera", Pose.from_rpy((0.3, 3.15, 1.5), (0.0, math.pi / 2, 0.0))),
)

BARE = Trial("bare", options=Options(insert_agvs=False))
"""A cell without anything optional."""

KITTING = Trial("kitting", orders=(order(),), extra_parts=on_tray(*GEARS), time_limit=None)
"""No arm; the ordered kit stands on the tray of AGV 1 from the start."""

WHOLE = Trial(
    "whole",
    has_arm=True,
    sensors=SENSORS,
    orders=(order(),),
    bin_parts=(ROD_IN_REACH, Part("bin8|gear_part_1", "gear_part", Pose((-0.3, 0.995, 0.725)))),
    extra_parts=on_tray(*GEARS),
    belt_parts=(BeltPart(0.2, "gear_part", Pose((0.0, 0.0, 0.1))),),
    options=Options(belt_population_cycles=3),
    faulty_parts=frozenset({"gear_part_2"}),
    material_locations={"gear_part": ("belt", "bin8"), "tray": ("agv1_load_point", "agv2_load_point")},
    initial_joint_states=ON_THE_ROD,
    time_limit=None,
)
"""Something of everything; the cup starts on a rod."""

ARM_ONLY = Trial("arm", has_arm=True, options=Options(insert_agvs=False))


def with_timestep(trial: Trial, timestep: Fraction) -> Trial:
    """Return the trial with another time step [s]."""
    settings = replace(trial.settings, timestep=(timestep.numerator, timestep.denominator))
    return replace(trial, settings=settings)


def with_seed(trial: Trial, seed: int) -> Trial:
    """Return the trial with another seed."""
    return replace(trial, settings=CellSettings(seed=seed))


def with_culling(trial: Trial, culling: bool) -> Trial:
    """Return the trial with collision culling on or off."""
    return replace(trial, settings=replace(trial.settings, collision_culling=culling))


def region(lower: tuple[float, float, float], upper: tuple[float, float, float], at: Pose) -> DropRegion:
    """Return a drop region for rods."""
    return DropRegion("region", "piston_rod_part", lower, upper, at)


def run(cell: Cell, seconds: float) -> None:
    """Step the cell for a time [s]."""
    cell.simulation.step_until(cell.simulation.now + nanoseconds(seconds))


def run_to(cell: Cell, seconds: float) -> None:
    """Step the cell up to a time [s]."""
    cell.simulation.step_until(nanoseconds(seconds))


class Ear:
    """Listener that stores the messages of topics, with the times [s] at which they came.

    Args:
        cell: the cell to listen to.
        topics: names; those under /ariac may leave that out.
        node: name of the listening node.
    """

    def __init__(self, cell: Cell, *topics: str, node: str = "/ear") -> None:
        self.messages: list[Any] = []
        self.times: list[float] = []
        self._cell = cell
        self._subscriptions = [cell.bus.subscribe(full(topic), self._hear, node=node) for topic in topics]

    def __len__(self) -> int:
        return len(self.messages)

    def cancel(self) -> None:
        """Stop listening."""
        for subscription in self._subscriptions:
            subscription.cancel()

    def _hear(self, message: Any) -> None:
        self.messages.append(message)
        self.times.append(self._cell.simulation.time)


def full(name: str) -> str:
    """Return an absolute name."""
    return name if name.startswith("/") else f"/ariac/{name}"


def call(cell: Cell, service: str, request: Any = None, node: str = "/client") -> Any:
    """Call a service, by default with an empty request."""
    return cell.bus.call(full(service), TriggerRequest() if request is None else request, node=node)


def publish(cell: Cell, topic: str, message: Any, node: str = "/client") -> None:
    """Publish a message to the cell."""
    cell.bus.publish(full(topic), message, node=node)


def start(cell: Cell) -> None:
    """Start the competition and advance one step."""
    assert call(cell, "start_competition").success
    cell.step()
    assert cell.competition.state is CompetitionState.GO


def way(*waypoints: tuple[float, ...], each: float = 1.0, names: tuple[str, ...] = JOINTS) -> JointTrajectory:
    """Return a trajectory message along joint positions, with `each` [s] between them."""
    points = [
        trajectory_point(positions, time_from_start=round((number + 1) * each * NANOSECONDS))
        for number, positions in enumerate(waypoints)
    ]
    return joint_trajectory(names, points)


def wanted(cell: Cell) -> list[float]:
    """Return the controller's present setpoints of the joints, in its order."""
    assert cell.arm is not None
    return list(cell.arm.controller.positions(cell.simulation.now))


def is_sound(cell: Cell) -> bool:
    """Return whether the engine has raised no warning."""
    data = cell.simulation.data
    return bool(np.isfinite(data.qpos).all()) and not any(warning.number for warning in data.warning)


def stamp_of(message: Any) -> int:
    """Return the stamp in a message's header [ns]."""
    return int(message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec)


def wait_until(cell: Cell, condition: Callable[[], bool], seconds: float) -> float:
    """Step the cell until a condition holds; return the time it took [s].

    Raises:
        AssertionError: the condition did not hold in that time.
    """
    begin = cell.simulation.now
    while not condition():
        assert cell.simulation.now - begin < nanoseconds(seconds), f"not so after {seconds} s"
        cell.step()
    return (cell.simulation.now - begin) / NANOSECONDS
