"""Controller of a robot: what is between the topics and the joints, in a world of its own or in a cell."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.robot.commander import Commander
from cellwright.robot.commands import RobotCommands
from cellwright.robot.drivers import Driver
from cellwright.robot.ee_poses import EePoses
from cellwright.robot.grippers import gripper_ranges
from cellwright.robot.homing import Homing
from cellwright.robot.interface import NAMESPACE
from cellwright.robot.notices import Notices
from cellwright.robot.publications import CameraTopics, RobotPublications
from cellwright.robot.safety import TIP_SPEED, TIP_TURNING, CommandGate, SafetySettings
from cellwright.robot.servos import JointServos, Motion


@dataclass(frozen=True)
class Place:
    """Surroundings of a robot's controller.

    Attributes:
        bus: has its topics and services; lines for the log go to its `on_notice`.
        now: returns the time of the run [ns].
        message_time: returns the time that messages carry [ns].
        offset: returns by how much that is ahead of the run's [ns], as after a reset that kept the clock.
        prefix: prefix of the robot's joints and devices in the simulation.
        namespace: namespace of its topics.
    """

    bus: Bus
    now: Callable[[], int]
    message_time: Callable[[], int]
    offset: Callable[[], int]
    prefix: str = ""
    namespace: str = NAMESPACE


class RobotController:
    """Controller of a robot: its devices, and the handlers of the rows of its interface.

    Args:
        config: the robot.
        model: the engine's model of the robot alone, for the kinematics of its arms.
        place: bus, times and names.
        safety: safety settings.
        motion: settings of the motion to targets.
        driver: moves the robot in place of its servos.

    Attributes:
        servos: the servos of the simulated joints.
        driver: mover of the robot: the servos, or a driver.
        commander: the targets of all joints.
        homing: the motion home.
        ee_poses: the motions of the arms' tips.
        grippers: the ranges of the grippers.
    """

    def __init__(
        self,
        config: RobotConfig,
        model: mujoco.MjModel,
        place: Place,
        safety: SafetySettings,
        *,
        motion: Motion = Motion.SERVO,
        driver: Driver | None = None,
    ) -> None:
        self._config, self._place = config, place
        self.servos = JointServos(config.robot, motion, place.prefix)
        self.driver: Driver = self.servos if driver is None else driver
        gate = CommandGate(safety, place.now, place.message_time, place.offset)
        place.bus.on_input.append(gate.note_arrival)

        def notify(line: str) -> None:
            for take in place.bus.on_notice:
                take(line)

        notices = Notices(place.now, notify)
        self.commander = Commander(
            self.driver, config.robot, safety, gate, notices, config.max_accelerations, place.namespace
        )
        self.homing = Homing(config, self.commander)
        caps = (safety.tip_speed or TIP_SPEED, safety.tip_turning or TIP_TURNING)
        self.ee_poses = EePoses(config, self.commander, model, place.message_time, caps)
        self.grippers = gripper_ranges(config.grippers, config.robot, self.commander.numbers)

    def add_devices(self, simulation: Simulation, *between: Device) -> None:
        """Add the devices in order: sources of targets act before the commander; others may act `between`."""
        simulation.add(self.servos)
        for device in (*between, self.ee_poses, self.commander, self.homing):
            device.name = f"{self._place.prefix}{device.name}"
            simulation.add(device)

    def handlers(self, cameras: dict[str, PictureCamera]) -> tuple[object, ...]:
        """Return the handlers of the rows of its interface, but for its base."""
        config, commander, grippers = self._config, self.commander, self.grippers
        return (
            RobotCommands(config, commander, grippers),
            self.homing,
            self.ee_poses,
            RobotPublications(config.robot, commander, grippers, self._place.message_time),
            CameraTopics(cameras, self._place.message_time),
        )
