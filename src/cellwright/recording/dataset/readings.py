"""Readings of a repeated run, channel by channel: what is measured, and what its joints and grippers were given."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.config.control import ControlSpace
from cellwright.config.trial.trial import Trial
from cellwright.envs.stepper import CellStepper
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.robot.node import RobotNode
from cellwright.robot.servos import Array
from cellwright.util.errors import UnknownNameError

_MAKER = "cellwright"


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings of a cell, or of a robot's node.

    Attributes:
        robot: kind of what is commanded, such as `cellwright_ur10`.
        names: names of the channels, in the order of the numbers.
        units: their units, `rad`, `m` or nothing.
        measured: returns the measured value of each channel: positions [rad; m], 1 for suction that is on, widths [m],
            shares by which the grippers of a node are closed.
        executed: returns the present target of each channel, after all limits, in the same units.
    """

    robot: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    measured: Callable[[], list[float]]
    executed: Callable[[], list[float]]


def readings_of(served: DrawnNode, rate: int) -> Readings:
    """Return the readings of a cell or of a robot's node.

    Args:
        served: the cell or the node.
        rate: frames in a second [Hz], with whole ticks in each.

    Raises:
        UsageError: the cell has no arm and no robot.
    """
    if isinstance(served, Cell):
        return _of_cell(served, rate)
    assert isinstance(served, RobotNode)  # recordings are of nothing else
    return _of_node(served)


def cameras_of(served: DrawnNode, names: Sequence[str]) -> list[PictureCamera]:
    """Return colour cameras of a cell or of a robot's node by their names; in a cell, `ROBOT/` is before a robot's.

    Raises:
        UnknownNameError: there is no such camera.
    """
    devices = served.simulation.devices
    found = {
        name: device
        for name, device in devices.items()
        if isinstance(device, PictureCamera) and device.description.has_colour
    }
    for name in names:
        if name not in found:
            raise UnknownNameError("colour camera", name, found)
    return [found[name] for name in names]


def _of_cell(cell: Cell, rate: int) -> Readings:
    stepper = CellStepper(cell, rate)
    robots = [
        (place, commander, commander.numbers[channel.joint])
        for place, channel in enumerate(stepper.space.channels)
        if channel.robot
        for commander in [cell.robots[channel.robot].commander]
    ]

    def executed() -> list[float]:
        values = stepper.desired()
        for place, commander, number in robots:
            values[place] = float(commander.applied[number])
        return values

    return Readings(_kind(cell.trial), stepper.space.names, stepper.space.units, stepper.read, executed)


def _kind(trial: Trial) -> str:
    """Return the arms and robots of a cell as one word."""
    robots = [trial.robot_models[robot.name].name for robot in trial.layout.robots]
    return "_".join([_MAKER, *(Path(arm.model).stem for arm in trial.arms), *robots])


def _of_node(node: RobotNode) -> Readings:
    space, commander, grippers = ControlSpace.of_node(node.config), node.commander, node.grippers
    joints = [commander.numbers[each.joint] for each in space.channels if each.kind == "joint"]

    def values(positions: Array) -> list[float]:
        return [*positions[joints].tolist(), *(each.status(positions) for each in grippers)]

    return Readings(
        f"{_MAKER}_{node.config.name}",
        space.names,
        space.units,
        lambda: values(commander.measured()),
        lambda: values(commander.applied),
    )
