"""Kit-building cell: trial, model, simulation, devices, kitting and interface in one object."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import mujoco

from cellwright.cell.competition import Competition
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.arm_guard import ArmGuard
from cellwright.cell.devices.collision_culling import CollisionCulling
from cellwright.cell.devices.conveyor import BeltDevices
from cellwright.cell.devices.grippers import grippers_of, tool_points
from cellwright.cell.devices.kit_sender import FixedTray, KitSender
from cellwright.cell.devices.kit_tray import DemoTray, KitTray
from cellwright.cell.devices.logical_camera import TRAY_TYPE, LogicalCamera, QualityControlSensor
from cellwright.cell.devices.parts import Overlaps, Parts
from cellwright.cell.devices.range_sensors import BreakBeam, LaserProfiler, ProximitySensor, RangeSensor
from cellwright.cell.devices.scene import ModelSnapshot, SceneModel, collision_geoms
from cellwright.cell.devices.vacuum_gripper import VacuumGripper, phase_of
from cellwright.cell.interface.action import actions_of
from cellwright.cell.interface.commands import CellCommands
from cellwright.cell.interface.controllers import ControllerServices
from cellwright.cell.interface.devices import CellDevices, Intention
from cellwright.cell.interface.frames import on_link
from cellwright.cell.interface.plugins import bind_plugin_sensors, make_plugin_device, make_plugin_sensor
from cellwright.cell.interface.publications import CellPublications
from cellwright.cell.interface.rows import rows
from cellwright.cell.model.build import World, build_world
from cellwright.cell.robots import add_robots
from cellwright.cell.start import CellSnapshot, Start
from cellwright.cell.tasks.monitor import TaskMonitor
from cellwright.cell.tasks.start import TaskStarter
from cellwright.cell.tasks.view import TaskView
from cellwright.cell.variation import Bounds
from cellwright.config.arm import ServoProfile
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.trial import Trial
from cellwright.engine.device import Device
from cellwright.engine.sensor import Sensor
from cellwright.engine.shapes import Visuals
from cellwright.engine.simulation import Simulation
from cellwright.engine.snapshot import Checkpoints, restore_snapshot, take_snapshot
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import bind
from cellwright.rendering.camera import Camera
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.rendering.cameras.render_service import RenderService
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.views import OVERVIEW, cameras
from cellwright.util.errors import UsageError

_RANGE_SENSORS: dict[str, type[RangeSensor[Any]]] = {
    "break_beam": BreakBeam,
    "proximity_sensor": ProximitySensor,
    "laser_profiler": LaserProfiler,
}


class Cell(CellDevices):
    """Kit-building cell, ready to run: `reset` begins a run, `step` advances one tick.

    Args:
        trial: description of the cell and its orders.
        seed: root of all random streams; None uses the trial's own.
        servo: servo profile of the arm; None uses the trial's own.
        competition: true refuses everything that a competition refuses (belt control, submitting a tray by hand, …).
        report: receives a line about refused input, at most one a second from each source.

    Raises:
        UnknownNameError: a frame or a joint that does not exist.
        UsageError: a sensor's name clashes with another topic.
        PluginError: a sensor or a device of another package cannot be used.

    Example:
        >>> from cellwright import Cell, Pose, Trial
        >>> from cellwright.config.trial.trial import Part
        >>> cell = Cell(Trial("falling", bin_parts=(Part("bin7|gear_part_1", "gear_part", Pose((-0.3, 0.2, 0.8))),)))
        >>> for _ in range(250):
        ...     cell.step()
        >>> gear = cell.parts.part("bin7|gear_part_1")
        >>> cell.simulation.time, round(cell.parts.pose(gear).position[2], 3)
        (0.5, 0.725)
    """

    def __init__(
        self,
        trial: Trial,
        *,
        seed: int | None = None,
        servo: ServoProfile | None = None,
        competition: bool = True,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        if servo is not None:
            if not all(arm.is_original for arm in trial.arms):
                raise UsageError(f"servo: {servo} is of the UR10 of 2017; leave it out")
            trial = replace(trial, settings=replace(trial.settings, arm=replace(trial.settings.arm, servo=servo)))
        self.start = Start(trial.settings.seed if seed is None else seed)
        """Seed, variation and posture of the arm with which the run began."""
        self._written = trial
        self.trial = trial = self.start.of(trial)
        """The trial of the run, with its variation."""
        self.world: World = build_world(trial)
        self.simulation = Simulation(
            self.world.model,
            timestep=Fraction(*trial.settings.timestep),
            seed=self.seed,
            first_pose=lambda data: self.world.set_initial_posture(data),
        )
        self._make_devices(trial)
        self._make_sensors(trial, report)
        self.checkpoints = Checkpoints(report)
        self.intention = Intention()
        """Announced intention of the agent; not part of the state."""
        for device in self._in_order():
            self.simulation.add(device)
        self.in_competition = competition
        """True if the cell refuses what a competition refuses."""
        self.bus = Bus(lambda: self.simulation.now, report)
        self._bind(trial)
        self.culling: CollisionCulling | None = None
        if trial.settings.collision_culling:
            # The last in `before_step`: it decides by the speeds, welds and wakes that all others left for the step.
            self.culling = CollisionCulling(self.conveyors.values(), self.overlaps)
            self.simulation.add(self.culling)
        self.reset()

    def _make_devices(self, trial: Trial) -> None:
        self.parts = Parts(self.world, lambda bodies: build_world(self.trial, bodies))
        self.overlaps = Overlaps(self.parts)
        self.conveyors, self.populations, self.deletion_walls = BeltDevices.of(trial, self.parts)
        self.trays = {each.number: KitTray(each, self.parts) for each in trial.stations}
        self.agvs = {each.number: Agv(each, self.trays[each.number]) for each in trial.carriers}
        fixed = [FixedTray(each.name, self.trays[each.number]) for each in trial.layout.trays]
        self.senders: dict[str, KitSender] = {each.name: each for each in (*self.agvs.values(), *fixed)}
        self.arms = Arm.of(trial)
        self.arm_guard = ArmGuard.of(trial, self.arms)
        self.grippers = grippers_of(trial, self.parts)
        self.competition = Competition(
            trial,
            parts=self.parts,
            conveyors=self.conveyors.values(),
            populations=self.populations.values(),
            senders=self.senders.values(),
            grippers=self.grippers.values(),
        )
        self.demo_tray = DemoTray.of(trial, self.trays.values(), self.parts)
        if self.demo_tray:
            self.competition.on_effect.append(self.demo_tray.take_effect)
        self.task: TaskMonitor | None = None
        """Judge of the trial's task; None without a section `task`."""
        self._task_starter: TaskStarter | None = None
        if trial.task is not None:
            self._task_starter = TaskStarter(trial.task, self.competition, self.grippers.values())
            trays = {each.name: self.trays[each.number] for each in trial.stations}
            self.task = TaskMonitor(
                trial.task, TaskView(self.simulation, self.parts, trays, self.grippers, self.competition)
            )

    def _make_sensors(self, trial: Trial, report: Callable[[str], None]) -> None:
        scene = self._make_scene()
        self.render_service = RenderService(
            self.simulation, partial(SceneCapture.of, self), about=self.views[OVERVIEW].target, report=report
        )
        """Renderer of the cameras' pictures."""
        self.sensors = {each.name: self._make_sensor(each, scene, report) for each in trial.sensors}
        self.quality = {each.number: QualityControlSensor(each, scene, trial.faulty_parts) for each in trial.carriers}

    def _in_order(self) -> Iterator[Device]:
        """Yield the devices in the order in which they act in a tick, begin a run and get a stored state back."""
        # Parts may give the engine a larger model, in `before_step` and with a stored state. All devices after it
        # work with the new model and its data only.
        yield self.parts
        # A run begins with the overlaps of what `parts` has put into play.
        yield self.overlaps
        yield from self.conveyors.values()
        # Events of one time and priority run in the order of scheduling. At the begin of a run that is this order, and
        # who repeats an event does so within it. So belts, walls, trays and AGVs follow each other in every run alike.
        yield from self.populations.values()
        yield from self.deletion_walls.values()
        yield from self.trays.values()
        yield from self.senders.values()
        # Arms and cups write setpoints and read contacts of their own: their place among the devices is free.
        yield from self.arms.values()
        yield from self.grippers.values()
        yield from filter(None, (self.arm_guard, self.demo_tray))
        yield from self.sensors.values()
        yield from self.quality.values()
        # The competition begins by emptying its picture of the trays, which have forgotten their reports by then. In a
        # tick its events have a priority behind all others.
        yield self.competition
        # A task begins when nothing of the last run is left.
        yield from filter(None, (self._task_starter, self.task))
        yield self.checkpoints

    def _bind(self, trial: Trial) -> None:
        """Bind the rows of the interface to their handlers, and add what plugins bring."""
        refusals = self.bus.refusals
        if self.arm_guard:
            self.arm_guard.on_stop.append(partial(refusals.warn, "arm_clearance"))
        arms = [(each.namespace or None, self.arms[each.name]) for each in trial.arms]
        managers = [ControllerServices(refusals, arm.joints, subject) for subject, arm in arms]
        handlers: list[Device] = [CellPublications(self), *actions_of(self)]
        # Handlers begin a run after the devices: they drop all messages of the last run, and publish the first ones.
        for each in handlers:
            self.simulation.add(each)
        commands = CellCommands(self, self.world), *managers
        bind(self.bus, self.simulation, rows(trial, competition=self.in_competition), (*commands, *handlers))
        self.robots = add_robots(trial, self.simulation, self.bus, self.render_service, self.parts)
        bind_plugin_sensors(self.bus, self)
        # Devices of plugins see the cell's own in their new state, and may publish as soon as a run begins.
        for description in trial.devices:
            self.simulation.add(make_plugin_device(description, self))

    @property
    def name(self) -> str:
        """Name of the trial."""
        return self.trial.name

    @property
    def seed(self) -> int:
        """Root of all random streams."""
        return self.start.seed

    @property
    def servo(self) -> ServoProfile:
        """Servo profile of the arm."""
        return self.trial.settings.arm.servo

    @property
    def drawn(self) -> tuple[mujoco.MjModel, Visuals]:
        """Model whose shapes are drawn, the simulation's, and the shapes on its bodies that are only seen."""
        return self.parts.world.model, self.parts.world.visuals

    def reset(
        self,
        *,
        keeps_clock: bool = False,
        seed: int | None = None,
        variation: bool | Bounds | None = None,
        joints: Mapping[str, float] | None = None,
    ) -> None:
        """Begin a run at time 0, with everything in its initial place; clients in this process forget the last one.

        The run is that of a new cell, bit for bit, but takes a fifth of the time to begin. What is not given stays as
        it was in the last run.

        Args:
            keeps_clock: message time goes on from its present value; otherwise it restarts at 0.
            seed: root of all random streams.
            variation: `True` varies the trial by the seed as `--vary` does, within other `Bounds` if given; `False`
                takes it as written.
            joints: positions of arm joints [rad; m for the rail] that the arm begins in, by name; the others begin as
                the trial says.

        Raises:
            UsageError: a value is out of range, or this is called within a tick.
            UnknownNameError: an arm joint that does not exist.
        """
        start, trial = self.check_start(seed=seed, variation=variation, joints=joints)
        self.intention.clear()
        self.simulation.reset(keeps_clock=keeps_clock, prepare=partial(self._prepare, start, trial))

    def check_start(
        self,
        *,
        seed: int | None = None,
        variation: bool | Bounds | None = None,
        joints: Mapping[str, float] | None = None,
    ) -> tuple[Start, Trial]:
        """Return start and trial of the run that `reset` would begin, with its errors; nothing changes."""
        start = self.start.changed(seed=seed, variation=variation, joints=joints, limits=self.trial.joints)
        return start, self.trial if start == self.start else start.of(self._written)

    def snapshot(self) -> CellSnapshot:
        """Return the whole state of now, with what clients in this process know, for `restore`.

        It has no effect on the run.

        Raises:
            UsageError: called within a tick.
        """
        return CellSnapshot(take_snapshot(self.simulation), self.start, self._written, self.in_competition)

    def restore(self, snapshot: CellSnapshot) -> None:
        """Go back, or ahead, to a snapshot of this cell, or of another cell of the same trial.

        The run continues as it did then, bit for bit. A client that was there in this process knows what it knew then;
        one that came later knows nothing yet but the latched messages. Clients of other processes get the latched
        messages once more. What a program itself remembers is its own matter.

        Raises:
            UsageError: the snapshot is of another trial or mode, a file of the run is being written, or this is called
                within a tick; the run goes on as it was.

        Example:
            >>> from cellwright import Cell, load_trial
            >>> cell = Cell(load_trial("lesson"))
            >>> before = cell.snapshot()
            >>> cell.simulation.step_until(100_000_000)
            >>> cell.restore(before)
            >>> cell.simulation.time
            0.0
        """
        if snapshot.written != self._written or snapshot.in_competition != self.in_competition:
            raise UsageError(
                f"restore: the snapshot is one of another cell, of trial {snapshot.written.name}; "
                "restore it in a cell of the same trial, servo profile and mode"
            )
        self.simulation.refuse_rewind()
        if snapshot.start != self.start:
            self.simulation.reset(prepare=partial(self._prepare, snapshot.start, snapshot.start.of(self._written)))
        self.intention.clear()
        restore_snapshot(self.simulation, snapshot.state, self.bus.deliver_latched)

    def _prepare(self, start: Start, trial: Trial) -> None:
        """Change the model and the devices to another start; the old state is of no more use."""
        if start == self.start:
            return
        self.start, self.simulation.seed = start, start.seed
        if trial == self.trial:
            return
        self.trial = self.competition.trial = trial
        self.world = self.parts.rearrange(trial)
        for population in self.populations.values():
            population.set_delay(trial.circumstances.belt_delay)
        for gripper in self.grippers.values():
            if isinstance(gripper, VacuumGripper):
                gripper.set_phase(phase_of(trial))

    def step(self) -> None:
        """Advance the simulation by one tick."""
        self.simulation.step()

    def topics(self) -> list[str]:
        """Return the names of all topics that the cell publishes."""
        return [topic.name for topic in self.bus.topics() if topic.publishers]

    @property
    def views(self) -> Mapping[str, Camera]:
        """Named views of the cell, `overview` first."""
        return cameras(self.trial.layout)

    def scene_parts(self) -> tuple[tuple[str, int, bool], ...]:
        """Return name, engine's body and visibility of each part; those that are not in play are hidden."""
        return self.parts.shown

    def scene_metadata(self, body_index: Callable[[int], int]) -> dict[str, Any]:
        """Return what viewers draw beside the scene.

        Args:
            body_index: maps a body id of the engine to the index in the scene's bodies, 0 for fixed bodies.

        Returns:
            `kind`, `sensors` as they describe themselves, and `tools`: the cups, and the middles between pads.
        """
        tools = tool_points(self.simulation.model, self.grippers.values(), body_index)
        return {"kind": "cell", "sensors": [each.describe() for each in self.sensors.values()], "tools": tools}

    def sensor_overlay(self) -> dict[str, Any]:
        """Return the overlay of each sensor's reading, by name; None for a sensor that is switched off.

        A reading is a function of state and time, so making one leaves no trace. See `Sensor.overlay`.
        """
        return {name: sensor.overlay() if sensor.enabled else None for name, sensor in self.sensors.items()}

    def state_hash(self) -> str:
        """Return the SHA-256 of the whole state: engine, events, devices, referee and score."""
        return self.simulation.state_hash()

    def _make_sensor(
        self, description: SensorConfig, scene: ModelSnapshot, report: Callable[[str], None]
    ) -> Sensor[Any]:
        if isinstance(description, PictureCameraConfig):
            return PictureCamera(on_link(description, self.trial), self.render_service, report=report)
        if description.type == "logical_camera":
            return LogicalCamera(description.name, description.pose, scene)
        if description.type in _RANGE_SENSORS:
            return _RANGE_SENSORS[description.type](description.name, description.pose)
        return make_plugin_sensor(description, scene)

    def _make_scene(self) -> ModelSnapshot:
        model = self.world.model
        geoms = {part.body: part for part in (*self.world.parts, *self.world.bodies)}
        models = [SceneModel(name, geoms[body].type, body, geoms[body].geoms) for name, body, _ in self.parts.shown]
        for each in self.trial.carriers:
            agv, tray = model.body(each.name).id, model.body(each.tray_link).id
            models += [
                SceneModel(each.name, each.name, agv, collision_geoms(model, agv), tray=each),
                SceneModel(each.tray_name, TRAY_TYPE, tray, collision_geoms(model, tray), nested_in=each.name),
            ]
        for fixed in self.trial.layout.trays:
            tray = model.body(fixed.tray_link).id
            models.append(SceneModel(fixed.tray_name, TRAY_TYPE, tray, collision_geoms(model, tray)))
        return ModelSnapshot(self.simulation, models, self.trial.part_models, self.scene_parts)
