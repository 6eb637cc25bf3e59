"""Published topics of the kit-building cell: messages made of readings, pictures of cameras, and when each is sent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np

from cellwright.cell.devices import range_sensors
from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import Population
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.logical_camera import CameraReading, Frame, LogicalCamera
from cellwright.cell.devices.range_sensors import (
    BEAM_LENGTH,
    BEAM_START,
    BeamReading,
    BreakBeam,
    LaserProfiler,
    ProfileReading,
    ProximityReading,
    ProximitySensor,
)
from cellwright.cell.devices.trajectory_controller import Following
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.interface.devices import GearDevices
from cellwright.cell.interface.frames import ArmFrames, all_static_frames
from cellwright.cell.interface.rows import camera_rows
from cellwright.cell.kitting.effects import Effect, OrderAnnounced
from cellwright.cell.kitting.inventory import TrayObject
from cellwright.config.layout import ARM_JOINTS
from cellwright.config.trial.trial import Order
from cellwright.engine.device import Device, State
from cellwright.engine.sensor import Sensor
from cellwright.middleware.bus import Bus, Publisher
from cellwright.middleware.interface.sampling import Sampled, Streamed, advertise
from cellwright.middleware.interface.table import Competition, Kind, Row, Where
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.middleware.messages.conversions import (
    header,
    joint_state,
    pose_message,
    single,
    singles,
    stamp,
    trajectory_point,
    transform_stamped,
)
from cellwright.middleware.messages.osrf_gear import (
    DetectedObject,
    Kit,
    KitObject,
    LogicalCameraImage,
    Model,
    PopulationState,
    Proximity,
    TrayContents,
    VacuumGripperState,
)
from cellwright.middleware.messages.osrf_gear import Order as OrderMessage
from cellwright.middleware.messages.standard import Clock, Float32, LaserScan, Range, String, TFMessage
from cellwright.rendering.cameras import interface as pictures
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera
from cellwright.util.errors import UsageError

ULTRASOUND = 0
"""sensor_msgs/Range.radiation_type of the proximity sensor."""

FIELD_OF_VIEW = 0.125
"""sensor_msgs/Range.field_of_view of the proximity sensor [rad]."""

# What is the same in each message of a sensor, in the order of its fields: dozens come in a second.
_BEAM_RANGES = single(BEAM_START), single(BEAM_START + BEAM_LENGTH)
_CONE = single(FIELD_OF_VIEW), single(range_sensors.PROXIMITY_MIN_RANGE), single(range_sensors.PROXIMITY_MAX_RANGE)
_FAN = (
    single(-range_sensors.FAN_HALF_ANGLE),
    single(range_sensors.FAN_HALF_ANGLE),
    single(2 * range_sensors.FAN_HALF_ANGLE / (range_sensors.FAN_RAY_COUNT - 1)),
    0.0,  # between two rays [s]
    0.0,  # between two scans [s]
    single(range_sensors.PROFILER_MIN_RANGE),
    single(range_sensors.PROFILER_MAX_RANGE),
)
_INTENSITIES = singles(np.zeros(range_sensors.FAN_RAY_COUNT))


def order_message(order: Order) -> OrderMessage:
    """An order as it is announced."""
    return OrderMessage(
        order.order_id,
        [
            Kit(kit.kit_type, [KitObject(each.type, pose_message(each.pose)) for each in kit.objects])
            for kit in order.kits
        ],
    )


def tray_message(tray_id: str, objects: Sequence[TrayObject]) -> TrayContents:
    """What a tray holds."""
    return TrayContents(
        tray_id, [DetectedObject(each.type, each.is_faulty, pose_message(each.tray_T_object)) for each in objects]
    )


def beam_message(reading: BeamReading, frame: str) -> Proximity:
    """A break beam's reading. The ranges are those of the ray, seen from the sensor's pose."""
    return Proximity(header(frame, reading.time_ns), reading.detected, *_BEAM_RANGES)


def range_message(reading: ProximityReading, frame: str) -> Range:
    """A proximity sensor's reading."""
    return Range(header(frame, reading.time_ns), ULTRASOUND, *_CONE, single(reading.range), 0.0)


def scan_message(reading: ProfileReading, frame: str) -> LaserScan:
    """A laser profiler's reading."""
    return LaserScan(header(frame, reading.time_ns), *_FAN, singles(reading.ranges), _INTENSITIES)


def image_message(reading: CameraReading) -> LogicalCameraImage:
    """A logical camera's picture: model poses in the camera frame, the camera's own in the world frame."""
    return LogicalCameraImage(
        [Model(each.type, pose_message(each.camera_T_model)) for each in reading.detections],
        pose_message(reading.world_T_camera),
    )


def frames_message(frames: Sequence[Frame], time: int) -> TFMessage:
    """Coordinate frames at a time [ns]."""
    return TFMessage([transform_stamped(each.parent, each.child, each.pose, time) for each in frames])


def controller_state_message(names: Sequence[str], following: Following, time: int) -> JointTrajectoryControllerState:
    """What the arm's controller wants and what the joints do."""
    desired = following.desired
    return JointTrajectoryControllerState(
        header("", time),
        list(names),
        trajectory_point(desired.positions, desired.velocities, desired.accelerations),
        trajectory_point(following.actual_positions, following.actual_velocities),
        trajectory_point(following.error_positions, following.error_velocities),
    )


_MakePicture = Callable[[Picture, PictureCamera], Message | None]


def bind_cameras(bus: Bus, devices: GearDevices) -> None:
    """Put the topics of all cameras on the bus."""
    for camera in devices.sensors.values():
        if isinstance(camera, PictureCamera):
            for row in camera_rows(camera.description):
                _stream_camera(bus, row, camera)


def _stream_camera(bus: Bus, row: Row, camera: PictureCamera) -> None:
    topic = row.template.removeprefix("/ariac/{sensor}")
    is_both = camera.description.has_colour and camera.description.has_depth
    make, colour, depth = {
        "/image_raw": (pictures.colour_message, True, False),
        "/camera_info": (pictures.info_message, False, False),
        "/depth/image_raw": (pictures.depth_message, False, True),
        "/depth/camera_info": (pictures.info_message, False, False),
        "/depth/points": (pictures.points_message, is_both, True),
        "": (pictures.cloud_message, False, True),
    }[topic]

    Streamed(bus, row, partial(camera.look, colour=colour, depth=depth), lambda picture: make(picture, camera))


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
            self._static.publish(frames_message(all_static_frames(self._devices), 0))

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
        self._sample(row, lambda: frames_message(frames.read(), simulation.now))

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

        Streamed(self._bus, row, listen, lambda reading: frames_message(reading.frames, reading.time_ns))

    # ---------------------------------------------------------------- the trial

    def _competition_state(self, row: Row) -> None:
        self._sample(row, lambda: String(str(self._devices.competition.state)))

    def _score(self, row: Row) -> None:
        self._sample(row, lambda: Float32(single(self._devices.competition.score().total)))

    def _orders(self, row: Row) -> None:
        publisher = advertise(self._bus, row)

        def tell(effect: Effect) -> None:
            if isinstance(effect, OrderAnnounced):
                publisher.publish(order_message(effect.order))

        self._devices.competition.on_effect.append(tell)

    def _trays(self, row: Row) -> None:
        publisher = advertise(self._bus, row)
        if self._is_competition and row.competition is Competition.SILENCED:
            return

        def tell(tray: KitTray) -> None:
            if publisher.listeners:
                objects = self._devices.competition.tray_objects(tray)
                publisher.publish(tray_message(tray.link, objects))

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
        self._sample(row, lambda: controller_state_message(ARM_JOINTS, arm.following(), arm.simulation.now))

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
        Streamed(self._bus, row, listen, lambda reading: beam_message(reading, sensor.frame))

    def _proximity(self, row: Row) -> None:
        sensor = self._sensor(row, ProximitySensor)
        Streamed(self._bus, row, sensor.listen, lambda reading: range_message(reading, sensor.frame))

    def _laser(self, row: Row) -> None:
        sensor = self._sensor(row, LaserProfiler)
        Streamed(self._bus, row, sensor.listen, lambda reading: scan_message(reading, sensor.frame))

    def _camera(self, row: Row) -> None:
        self._stream_images(row, self._sensor(row, LogicalCamera))

    def _quality(self, row: Row) -> None:
        self._stream_images(row, self._devices.quality[int(row.subject or 0)])

    def _stream_images(self, row: Row, camera: LogicalCamera) -> None:
        Streamed(self._bus, row, camera.listen, image_message, is_deferred=True)
