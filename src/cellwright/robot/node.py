"""The robot controller node: the one place where robot, world, simulation, servos, safety and contract are joined."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from fractions import Fraction
from typing import Any

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import bind
from cellwright.robot import interface as io_teleop
from cellwright.robot.base import Base
from cellwright.robot.commander import Commander, Homing
from cellwright.robot.commands import Commands
from cellwright.robot.drivers import Driver, LiveDriver, Mirror, close_driver
from cellwright.robot.ee_poses import EePoses
from cellwright.robot.grippers import gripper_ranges
from cellwright.robot.model import TIMESTEP, body_of, build_robot
from cellwright.robot.publications import CameraTopics, Publications, add_cameras
from cellwright.robot.safety import TIP_SPEED, TIP_TURNING, CommandGate, Notices, SafetySettings
from cellwright.robot.servos import JointServos, Motion
from cellwright.util.pose import Pose


class RobotNode:
    """A robot and its node, ready to run: each `simulation.step()` lets 1/240 s pass.

    Args:
        config: the robot.
        motion: how targets are reached.
        timestep: length of a step [s].
        self_collision: whether links may touch each other.
        safety: what is guarded against.
        node: name of the node in ROS.
        sim_time: whether messages carry simulation time, which is then told on /clock.
        stamp: the time that messages carry [ns], where that is not simulation time.
        report: takes a line about refused input, at most one a second from each source.
        driver: moves the robot in place of the simulation, which then only shows it; it is closed with the node, also
            when there comes to be none.

    Raises:
        DriverError: the driver is not this robot's, or cannot be read.
    """

    in_competition = False

    def __init__(
        self,
        config: RobotConfig,
        *,
        motion: Motion = Motion.SERVO,
        timestep: Fraction = TIMESTEP,
        self_collision: bool = False,
        safety: SafetySettings = SafetySettings(),  # noqa: B008
        node: str = io_teleop.NODE,
        sim_time: bool = False,
        stamp: Callable[[], int] | None = None,
        report: Callable[[str], None] = lambda _line: None,
        driver: Driver | None = None,
    ) -> None:
        self._is_closed = False
        self.made_with = {
            "motion": motion.value,
            "timestep": [timestep.numerator, timestep.denominator],
            "self_collision": self_collision,
            "safety": {**asdict(safety), "guard": safety.guard.value},
            "node": node,
            "sim_time": sim_time,
            "driver": driver is not None,
        }
        """What it was made with besides its robot, as JSON values: what is needed to make it again."""
        self.config = config
        self.name = config.name
        with ExitStack() as on_failure:
            if driver is not None:
                on_failure.callback(close_driver, driver)
            self.world = build_robot(config, timestep=timestep, self_collision=self_collision)
            self.simulation = Simulation(self.world.model, timestep=timestep, first_pose=self.world.put_in_first_pose)
            self.servos = JointServos(config.robot, motion)
            self.driver: Driver = self.servos
            if driver is not None:
                on_failure.pop_all()  # from here on it is closed by the thread that calls it
                self.driver = live = LiveDriver(config, driver)
                on_failure.callback(live.close)
            now = self.simulation.clock.read
            self.bus = Bus(now, report)
            self.told = told = stamp if stamp is not None and not sim_time else now
            """The time that messages carry [ns]."""
            gate = CommandGate(safety, now, told)
            self.bus.on_given.append(gate.note_arrival)
            self.commander = Commander(
                self.driver, config.robot, safety, gate, Notices(now, report), config.max_accelerations
            )
            self.homing = Homing(config, self.commander)
            self.base = Base(config)
            caps = (safety.tip_speed or TIP_SPEED, safety.tip_turning or TIP_TURNING)
            self.ee_poses = EePoses(config, self.commander, told, caps)
            self.commander.on_hold.append(self.base.halt)
            self._add_devices()
            grippers = gripper_ranges(config.grippers, config.robot, self.commander.numbers)
            self.cameras = add_cameras(config, self.simulation, report)
            """The cameras of the configuration that take pictures, by name."""
            table = io_teleop.rows(config, cameras=self.cameras, node=node, sim_time=sim_time)
            handlers = (
                Commands(config, self.commander, grippers, self.base),
                self.homing,
                self.ee_poses,
                Publications(config.robot, self.driver, self.commander, grippers, told),
                CameraTopics(self.cameras, told),
            )
            bind(self.bus, self.simulation, table, handlers)
            self.simulation.reset()
            on_failure.pop_all()

    def _add_devices(self) -> None:
        """Give the devices their places: what brings targets acts before the commander, which gives them on."""
        self.simulation.add(self.servos)
        if isinstance(self.driver, LiveDriver):
            self.commander.on_clear.append(self.driver.clear)
            # It may have been moved by hand meanwhile.
            self.commander.on_clear.append(lambda: self.commander.hold(self.commander.why_held))
            self.simulation.add(Mirror(self.driver, self.servos, self.commander.stop, self.commander.stand))
        for device in (self.base, self.ee_poses, self.commander, self.homing):
            self.simulation.add(device)

    @property
    def refused(self) -> int:
        """How many commands and calls were refused."""
        return self.bus.refusals.total

    def out_of_sight(self) -> tuple[int, ...]:
        """Ids of bodies that are not there to be seen: none."""
        return ()

    def link_pose(self, link: str) -> Pose:
        """World_T_link, as the engine's model stands."""
        self.simulation.refresh()
        body = self.simulation.data.body(body_of(link))
        return Pose(tuple(body.xpos.tolist()), tuple(body.xquat.tolist()))

    def scene_metadata(self, body_index: Callable[[int], int]) -> dict[str, Any]:
        """What viewers draw beside the scene: `kind`, `sensors`: none, `tools`: the tips of the arms.

        `body_index` gives the index in the scene's bodies, 0 for what stands still, for an id of the engine.
        """
        model = self.simulation.model
        bodies = [body_index(int(model.body(body_of(arm.tip)).id)) for arm in self.config.arms]
        return {"kind": "robot", "sensors": [], "tools": [[body, [0.0, 0.0, 0.0]] for body in bodies if body]}

    def sensor_overlay(self) -> dict[str, Any]:
        """What viewers draw of sensors: nothing."""
        return {}

    def close(self) -> None:
        """End: the robot is let go of. Again is no error."""
        if not self._is_closed:
            self._is_closed = True
            self.simulation.close()
