"""What the kit-building cell says: every topic of the 2017 contract that leaves it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.gripper.vacuum_gripper import VacuumGripper
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.population import Population
from cellwright.cell.devices.sensors.break_beam import BreakBeam
from cellwright.cell.devices.sensors.laser_profiler import LaserProfiler
from cellwright.cell.devices.sensors.logical_camera import CameraReading, LogicalCamera
from cellwright.cell.devices.sensors.proximity import ProximitySensor
from cellwright.cell.interface import messages
from cellwright.cell.interface.devices import GearDevices
from cellwright.cell.interface.frames import ArmFrames, all_static_frames
from cellwright.cell.kitting.effects import Effect, OrderAnnounced
from cellwright.config.layout import ARM_JOINTS
from cellwright.engine.device import Device, State
from cellwright.engine.sensor import Sensor
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.interface.sampling import Sampled, Streamed, advertise
from cellwright.middleware.interface.table import Competition, Kind, Row, Where
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.build import joint_state, single, stamp
from cellwright.middleware.messages.osrf_gear import PopulationState, VacuumGripperState
from cellwright.middleware.messages.standard import Clock, Float32, String
from cellwright.util.errors import UsageError

GRIPPER_JOINT = "vacuum_gripper_joint"
"""A joint that does not move; the original's controller states it as an extra joint, always at 0."""

STATED_JOINTS = (*sorted(ARM_JOINTS), GRIPPER_JOINT)
"""The names of the joint states, in their order."""

_CLOCK_RANK = -10  # a message never comes before the clock that it is stamped with

S = TypeVar("S", bound=Sensor[Any])


class Publications(Device):
    """Puts the topics of one cell on its bus.

    What is latched belongs to a run: a new one begins with nothing but the fixed frames, and one that goes on from a
    saved moment with the order that was the newest then.

    Args:
        bus: where to.
        devices: what is told about.
        rows: the contract as it holds in this cell.
    """

    def __init__(self, bus: Bus, devices: GearDevices, rows: tuple[Row, ...], *, competition: bool) -> None:
        super().__init__("/ariac")
        self._bus = bus
        self._devices = devices
        self._static: Publisher | None = None
        self._is_competition = competition
        self._rows = rows
        for row in rows:
            if row.kind is Kind.TOPIC and row.rate is not None:
                self._bind(row)

    # ---------------------------------------------------------------- life

    def reset(self) -> None:
        """A new run: no message of the last one is left."""
        self._bus.forget_latched()
        if self._static is not None:
            self._static.publish(messages.frames_message(all_static_frames(self._devices), 0))

    def get_state(self) -> State:
        """The newest message of each latched topic."""
        return {"latched": self._bus.latched()}

    def set_state(self, state: State) -> None:
        """Go on from a saved moment."""
        self.reset()
        self._bus.set_latched(state["latched"])

    # ---------------------------------------------------------------- binding

    def _bind(self, row: Row) -> None:
        by_place: dict[Where, Callable[[Row], None]] = {
            Where.BREAK_BEAM: self._break_beam,
            Where.PROXIMITY_SENSOR: self._proximity,
            Where.LASER_PROFILER: self._laser,
            Where.LOGICAL_CAMERA: self._camera,
            Where.CAMERAS: self._camera_frames,
        }
        by_name: dict[str, Callable[[Row], None]] = {
            "/clock": self._clock,
            "/tf": self._arm_frames,
            "/tf_static": self._static_frames,
            "/ariac/competition_state": self._competition_state,
            "/ariac/current_score": self._score,
            "/ariac/orders": self._orders,
            "/ariac/joint_states": self._joint_states,
            "/ariac/arm/state": self._arm_state,
            "/ariac/gripper/state": self._gripper,
            "/ariac/agv{n}/state": self._agv,
            "/ariac/quality_control_sensor_{n}": self._quality,
            "/ariac/trays": self._trays,
            "/ariac/population/state": self._population,
        }
        bind = by_place.get(row.where) or by_name.get(row.template)
        if bind is not None:  # the action's topics are bound by the action
            bind(row)

    def _sample(self, row: Row, build: Callable[[], Message], *, rank: int | None = None) -> None:
        rank = 1 + self._rows.index(row) if rank is None else rank
        Sampled(self._bus, self._devices.simulation, row, row.period, build, rank=rank)

    # ---------------------------------------------------------------- time and frames

    def _clock(self, row: Row) -> None:
        simulation = self._devices.simulation
        self._sample(row, lambda: Clock(stamp(simulation.now)), rank=_CLOCK_RANK)

    def _arm_frames(self, row: Row) -> None:
        simulation = self._devices.simulation
        frames = ArmFrames(simulation)
        self._sample(row, lambda: messages.frames_message(frames.read(), simulation.now))

    def _static_frames(self, row: Row) -> None:
        self._static = advertise(self._bus, row)

    def _camera_frames(self, row: Row) -> None:
        cameras = [each for each in self._devices.sensors.values() if isinstance(each, LogicalCamera)]

        def listen(take: Callable[[CameraReading], None]) -> Callable[[], None]:
            leave = [camera.listen(take) for camera in (*cameras, *self._devices.quality.values())]

            def leave_all() -> None:
                for each in leave:
                    each()

            return leave_all

        Streamed(self._bus, row, listen, lambda reading: messages.frames_message(reading.frames, reading.time_ns))

    # ---------------------------------------------------------------- the trial

    def _competition_state(self, row: Row) -> None:
        self._sample(row, lambda: String(str(self._devices.competition.state)))

    def _score(self, row: Row) -> None:
        self._sample(row, lambda: Float32(single(self._devices.competition.score().total)))

    def _orders(self, row: Row) -> None:
        publisher = advertise(self._bus, row)

        def tell(effect: Effect) -> None:
            if isinstance(effect, OrderAnnounced):
                publisher.publish(messages.order_message(effect.order))

        self._devices.competition.on_effect.append(tell)

    def _trays(self, row: Row) -> None:
        publisher = advertise(self._bus, row)
        if self._is_competition and row.competition is Competition.SILENCED:
            return

        def tell(tray: KitTray) -> None:
            if publisher.listeners:
                objects = self._devices.competition.tray_objects(tray)
                publisher.publish(messages.tray_message(tray.link, objects))

        for tray in self._devices.trays.values():
            tray.on_report.append(tell)

    # ---------------------------------------------------------------- arm, gripper, AGVs, belt

    def _joint_states(self, row: Row) -> None:
        arm = cast("Arm", self._devices.arm)
        order = [ARM_JOINTS.index(name) for name in STATED_JOINTS[:-1]]

        def build() -> Message:
            columns = [[*(column[index] for index in order), 0.0] for column in arm.read()]
            return joint_state(STATED_JOINTS, *columns, time=arm.simulation.now)

        self._sample(row, build)

    def _arm_state(self, row: Row) -> None:
        arm = cast("Arm", self._devices.arm)
        self._sample(row, lambda: messages.controller_state_message(ARM_JOINTS, arm.following(), arm.simulation.now))

    def _gripper(self, row: Row) -> None:
        gripper = cast("VacuumGripper", self._devices.gripper)
        states = {
            (enabled, attached): VacuumGripperState(enabled=enabled, attached=attached)
            for enabled in (False, True)
            for attached in (False, True)
        }
        self._sample(row, lambda: states[gripper.enabled, gripper.attached])

    def _agv(self, row: Row) -> None:
        agv: Agv = self._devices.agvs[int(row.subject or 0)]
        made: dict[str, String] = {}
        self._sample(row, lambda: made.get(agv.state) or made.setdefault(agv.state, String(agv.state)))

    def _population(self, row: Row) -> None:
        population = cast("Population", self._devices.population)
        states = {enabled: PopulationState(enabled=enabled) for enabled in (False, True)}
        self._sample(row, lambda: states[population.enabled])

    # ---------------------------------------------------------------- sensors

    def _sensor(self, row: Row, kind: type[S]) -> S:
        sensor = self._devices.sensors[row.subject or ""]
        if not isinstance(sensor, kind):
            raise UsageError(f"sensor {row.subject!r} is a {type(sensor).__name__}, not a {kind.__name__}")
        return sensor

    def _break_beam(self, row: Row) -> None:
        sensor = self._sensor(row, BreakBeam)
        listen = sensor.listen if row.period is not None else sensor.listen_changes
        Streamed(self._bus, row, listen, lambda reading: messages.beam_message(reading, sensor.frame))

    def _proximity(self, row: Row) -> None:
        sensor = self._sensor(row, ProximitySensor)
        Streamed(self._bus, row, sensor.listen, lambda reading: messages.range_message(reading, sensor.frame))

    def _laser(self, row: Row) -> None:
        sensor = self._sensor(row, LaserProfiler)
        Streamed(self._bus, row, sensor.listen, lambda reading: messages.scan_message(reading, sensor.frame))

    def _camera(self, row: Row) -> None:
        self._stream_images(row, self._sensor(row, LogicalCamera))

    def _quality(self, row: Row) -> None:
        self._stream_images(row, self._devices.quality[int(row.subject or 0)])

    def _stream_images(self, row: Row, camera: LogicalCamera) -> None:
        Streamed(self._bus, row, camera.listen, messages.image_message, is_deferred=True)
