"""Robot controller node: joins robot, world, simulation, servos, safety and interface."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from functools import partial
from typing import Any

import mujoco

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.device import Device
from cellwright.engine.shapes import Visuals
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import bind
from cellwright.middleware.interface.notes import Notes
from cellwright.rendering.camera import Camera
from cellwright.rendering.cameras.render_service import RenderService
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.robot import interface as io_teleop
from cellwright.robot.base import Base
from cellwright.robot.commands import BaseCommands
from cellwright.robot.controller import Place, RobotController
from cellwright.robot.drivers import Driver, LiveDriver, Mirror, close_driver
from cellwright.robot.model import TIMESTEP, body_of, build_robot
from cellwright.robot.publications import add_cameras
from cellwright.robot.safety import SafetySettings
from cellwright.robot.servos import Motion
from cellwright.util.pose import Pose


@dataclass(frozen=True)
class RobotSettings:
    """Settings of a robot's node.

    Attributes:
        motion: settings of the motion to targets.
        timestep: length of a step [s].
        self_collision: enables contacts between links.
        safety: safety settings.
        node: name of the node in ROS.
        sim_time: stamps messages with simulation time, which is then published on /clock.
    """

    motion: Motion = Motion.SERVO
    timestep: Fraction = TIMESTEP
    self_collision: bool = False
    safety: SafetySettings = field(default_factory=SafetySettings)
    node: str = io_teleop.NODE
    sim_time: bool = False


class RobotNode:
    """A robot and its node, ready to run: each `simulation.step()` advances by 1/240 s.

    Example:
        >>> from cellwright.config.robot.robots import load_robot
        >>> from cellwright.middleware.messages.conversions import joint_state
        >>> node = RobotNode(load_robot("tandem", warn=print))
        >>> node.bus.publish("/io_teleop/joint_cmd", joint_state(["lift"], [0.2], time=0))
        >>> node.simulation.step_until(1_000_000_000)
        >>> round(float(node.driver.read().positions[node.commander.numbers["lift"]]), 2)
        0.2
        >>> node.close()

    Args:
        config: the robot.
        settings: its settings.
        stamp: returns the time that messages carry [ns], if that is not simulation time.
        report: called with a line about refused input, at most one a second from each source.
        driver: moves the robot instead of the simulation, which then only shows it. It is closed with the node, and
            also if making the node fails.

    Raises:
        DriverError: the driver is not this robot's, or cannot be read.
    """

    in_competition = False

    def __init__(
        self,
        config: RobotConfig,
        settings: RobotSettings = RobotSettings(),
        *,
        stamp: Callable[[], int] | None = None,
        report: Callable[[str], None] = lambda _line: None,
        driver: Driver | None = None,
    ) -> None:
        self._is_closed = False
        self.config, self.settings = config, settings
        self.name = config.name
        self.has_driver = driver is not None
        """True if a driver moves the robot, not the simulation."""
        safety, sim_time = settings.safety, settings.sim_time
        with ExitStack() as on_failure:
            if driver is not None:
                on_failure.callback(close_driver, driver)
            self.world = build_robot(config, timestep=settings.timestep, self_collision=settings.self_collision)
            self.simulation = Simulation(
                self.world.stepping, timestep=settings.timestep, first_pose=self.world.set_initial_posture
            )
            live = None
            if driver is not None:
                # From here on its thread closes it.
                on_failure.pop_all()
                live = LiveDriver(config, driver)
                on_failure.callback(live.close)
            clock = self.simulation.clock
            self.bus = Bus(clock.read, report)
            self.bus.on_notice.append(report)
            self.message_time = stamp if stamp and not sim_time else clock.message_time
            """Function that returns the time that messages carry [ns]."""
            place = Place(
                self.bus, clock.read, self.message_time, lambda: 0 if stamp and not sim_time else clock.offset
            )
            self.base = Base(config)
            self.controller = controller = RobotController(
                config, self.world.stepping, place, safety, motion=settings.motion, driver=live
            )
            self.servos, self.driver, self.commander = controller.servos, controller.driver, controller.commander
            self.homing, self.ee_poses, self.grippers = controller.homing, controller.ee_poses, controller.grippers
            self.commander.on_hold.append(self.base.halt)
            self._add_devices(live)
            about = config.base_pose.position
            service = RenderService(self.simulation, partial(SceneCapture.of, self), about=about, report=report)
            self.cameras = add_cameras(config, self.simulation, service, report)
            """The working cameras of the configuration, by name."""
            table = io_teleop.rows(config, cameras=self.cameras, node=settings.node, sim_time=sim_time)
            handlers = (*controller.handlers(self.cameras), BaseCommands(self.commander, self.base), Notes())
            bind(self.bus, self.simulation, table, handlers)
            self.simulation.reset()
            on_failure.pop_all()

    @property
    def made_with(self) -> dict[str, Any]:
        """Its settings besides the robot, as JSON values, from which it can be made again."""
        settings = self.settings
        return {
            "motion": settings.motion.value,
            "timestep": list(settings.timestep.as_integer_ratio()),
            "self_collision": settings.self_collision,
            "safety": {**asdict(settings.safety), "guard": settings.safety.guard.value},
            "node": settings.node,
            "sim_time": settings.sim_time,
            "driver": self.has_driver,
        }

    def _add_devices(self, live: LiveDriver | None) -> None:
        between: list[Device] = [self.base]
        if live is not None:
            self.commander.on_clear.append(live.clear)
            # It may have been moved by hand meanwhile.
            self.commander.on_clear.append(lambda: self.commander.hold(self.commander.why_held))
            between.insert(0, Mirror(live, self.servos, self.commander.stop, self.commander.hold_until_commanded))
        self.controller.add_devices(self.simulation, *between)

    @property
    def refused(self) -> int:
        """Number of refused commands and calls."""
        return self.bus.refusals.total

    @property
    def drawn(self) -> tuple[mujoco.MjModel, Visuals]:
        """Model whose shapes are drawn, with the bodies of the simulation's, and more shapes: none."""
        return self.world.model, Visuals()

    @property
    def views(self) -> Mapping[str, Camera]:
        """Named views of a cell: none."""
        return {}

    def scene_parts(self) -> tuple[()]:
        """Return the parts of a cell: none."""
        return ()

    def link_pose(self, link: str) -> Pose:
        """Return world_T_link in the engine's model."""
        self.simulation.refresh()
        body = self.simulation.data.body(body_of(link))
        return Pose(tuple(body.xpos.tolist()), tuple(body.xquat.tolist()))

    def scene_metadata(self, body_index: Callable[[int], int]) -> dict[str, Any]:
        """Return what viewers draw beside the scene: `kind`, `sensors`: none, `tools`: the tips of the arms.

        `body_index` maps an id of the engine to an index in the scene's bodies, 0 for fixed ones.
        """
        model = self.simulation.model
        bodies = [body_index(int(model.body(body_of(arm.tip)).id)) for arm in self.config.arms]
        return {"kind": "robot", "sensors": [], "tools": [[body, [0.0, 0.0, 0.0]] for body in bodies if body]}

    def sensor_overlay(self) -> dict[str, Any]:
        """Return what viewers draw of sensors: nothing."""
        return {}

    def close(self) -> None:
        """Close the node and release the robot. A second call does nothing."""
        if not self._is_closed:
            self._is_closed = True
            self.simulation.close()
