"""Published topics of the kit-building cell: messages from readings, camera images, and the time of each message."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial, partialmethod
from typing import Any

import numpy as np

from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.logical_camera import CameraReading, LogicalCamera, TfFrame
from cellwright.cell.devices.range_sensors import (
    FAN_ANGLE_STEP,
    FAN_HALF_ANGLE,
    FAN_RAY_COUNT,
    BeamReading,
    BreakBeam,
    LaserProfiler,
    ProfileReading,
    ProximityReading,
    ProximitySensor,
)
from cellwright.cell.interface.devices import CellDevices, named, of_arm
from cellwright.cell.interface.encoded import (
    POSE_FIELDS,
    made_once,
    pose_numbers,
    sample_following,
    sample_joints,
    sample_links,
)
from cellwright.cell.interface.frames import arm_frames, fixed_arm_frames, robot_frames, static_frames
from cellwright.cell.kitting.effects import Effect, KitSubmitted, OrderAnnounced
from cellwright.cell.kitting.inventory import TrayObject
from cellwright.config.trial.trial import Order
from cellwright.config.ur10 import GRIPPER_JOINT
from cellwright.engine.device import Device, State
from cellwright.middleware.interface.binding import Output, publish_clock
from cellwright.middleware.messages import Message, osrf_gear
from cellwright.middleware.messages.conversions import header, pose_message, single, singles, stamp, transform_message
from cellwright.middleware.messages.osrf_gear import Order as OrderMessage
from cellwright.middleware.messages.standard import (
    Float32,
    Header,
    LaserScan,
    Range,
    String,
    TFMessage,
    TransformStamped,
)
from cellwright.middleware.messages.template import CdrTemplates
from cellwright.rendering.cameras import interface as pictures
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera

ULTRASOUND = 0
"""sensor_msgs/Range.radiation_type of the proximity sensor."""

FIELD_OF_VIEW = 0.125
"""sensor_msgs/Range.field_of_view of the proximity sensor [rad]."""

# The part that is the same in each message of a sensor, in the order of its fields: dozens are sent each second.
_BEAM_RANGES = single(BreakBeam.source[0]), single(BreakBeam.source[0] + BreakBeam.farthest)
_CONE = single(FIELD_OF_VIEW), single(ProximitySensor.nearest), single(ProximitySensor.farthest)
_FAN = (
    single(-FAN_HALF_ANGLE),
    single(FAN_HALF_ANGLE),
    single(FAN_ANGLE_STEP),
    0.0,  # time between two rays [s]
    0.0,  # time between two scans [s]
    single(LaserProfiler.nearest),
    single(LaserProfiler.farthest),
)
_INTENSITIES = singles(np.zeros(FAN_RAY_COUNT))
_PictureMessage = Callable[[Picture, PictureCamera], Message | None]


def order_message(order: Order) -> OrderMessage:
    """Return the message of an announced order."""
    return OrderMessage(
        order.order_id,
        [
            osrf_gear.Kit(
                kit.kit_type, [osrf_gear.KitObject(each.type, pose_message(each.pose)) for each in kit.objects]
            )
            for kit in order.kits
        ],
    )


def tray_message(tray_id: str, objects: Sequence[TrayObject]) -> osrf_gear.TrayContents:
    """Return the message of a tray's contents."""
    return osrf_gear.TrayContents(
        tray_id,
        [osrf_gear.DetectedObject(each.type, each.is_faulty, pose_message(each.tray_T_object)) for each in objects],
    )


def beam_message(reading: BeamReading, beam: BreakBeam) -> osrf_gear.Proximity:
    """Return the message of a break beam's reading; the ranges are those of the ray, from the sensor's pose."""
    return osrf_gear.Proximity(header(beam.frame, reading.time_ns), reading.detected, *_BEAM_RANGES)


def range_message(reading: ProximityReading, sensor: ProximitySensor) -> Range:
    """Return the message of a proximity sensor's reading."""
    return Range(header(sensor.frame, reading.time_ns), ULTRASOUND, *_CONE, single(reading.range), 0.0)


def scan_message(reading: ProfileReading, profiler: LaserProfiler) -> LaserScan:
    """Return the message of a laser profiler's reading."""
    return LaserScan(header(profiler.frame, reading.time_ns), *_FAN, singles(reading.ranges), _INTENSITIES)


def image_message(reading: CameraReading) -> osrf_gear.LogicalCameraImage:
    """Return the message of a logical camera's image, with model poses in the camera frame, its own in the world."""
    return osrf_gear.LogicalCameraImage(
        [osrf_gear.Model(each.type, pose_message(each.camera_T_model)) for each in reading.detections],
        pose_message(reading.world_T_camera),
    )


def frames_message(frames: Sequence[TfFrame], time: int) -> TFMessage:
    """Return the message of coordinate frames at a time [ns]; frames of one parent share its header."""
    at = stamp(time)
    headers = {each.parent: Header(at, each.parent) for each in frames}
    return TFMessage(
        [TransformStamped(headers[each.parent], each.child, transform_message(each.pose)) for each in frames]
    )


class CellPublications(Device):
    """Handlers of the topics that the cell publishes, with their latched messages, which belong to a run.

    A new run starts with the fixed frames only. A run from a checkpoint also starts with the order that was the latest
    then.
    """

    def __init__(self, cell: CellDevices) -> None:
        super().__init__("/ariac")
        self._cell = cell

    def reset(self) -> None:
        """Start a new run, without messages of the previous one."""
        cell = self._cell
        cell.bus.forget_latched()
        arm = fixed_arm_frames(cell.simulation, cell.trial)
        self._static.publish(frames_message([*static_frames(cell.trial), *arm], 0))

    def get_state(self) -> State:
        """Return the latest message of each latched topic."""
        return {"latched": self._cell.bus.latched(self._cell.simulation.clock.offset)}

    def set_state(self, state: State) -> None:
        """Restore the latched messages from a checkpoint."""
        self.reset()
        self._cell.bus.set_latched(state["latched"], self._cell.simulation.clock.offset)

    clock = staticmethod(publish_clock)

    def arm_frames(self, output: Output) -> None:
        """Frames of the arm's moving links."""
        sample_links(output, arm_frames(self._cell.simulation, self._cell.trial))

    def robot_frames(self, output: Output) -> None:
        """Frames of links and cameras of robots; of their own, since robot_state_publisher of ROS 1 knows only arms."""
        sample_links(output, robot_frames(self._cell.simulation, self._cell.trial))

    def static_frames(self, output: Output) -> None:
        """Frames that never move, once in a run."""
        self._static = output.advertise()

    def camera_frames(self, output: Output) -> None:
        """Frames of the logical cameras, and of the models that they see."""
        cameras = [each for each in self._cell.sensors.values() if isinstance(each, LogicalCamera)]

        def listen(take: Callable[[CameraReading], None]) -> Callable[[], None]:
            leave = ExitStack()
            for camera in (*cameras, *self._cell.quality.values()):
                leave.callback(camera.listen(take))
            return leave.close

        templates = CdrTemplates(output.bus.types, POSE_FIELDS)

        def encode(reading: CameraReading) -> bytes:
            frames, time = reading.frames, reading.time_ns
            shape = tuple((each.parent, each.child) for each in frames)
            numbers = pose_numbers([each.pose for each in frames])
            return templates.filled(shape, lambda: frames_message(frames, time), time, numbers)

        output.stream(listen, lambda reading: frames_message(reading.frames, reading.time_ns), encode=encode)

    def competition_state(self, output: Output) -> None:
        """State of the competition."""
        output.sample(lambda: String(str(self._cell.competition.state)))

    def current_score(self, output: Output) -> None:
        """The score so far, also when a kit is judged: a run may end before the next sample."""
        score = output.sample(lambda: Float32(single(self._cell.competition.score().total)))

        def publish(effect: Effect) -> None:
            if isinstance(effect, KitSubmitted):
                score.publish()

        self._cell.competition.on_effect.append(publish)

    def orders(self, output: Output) -> None:
        """Each order when it is announced."""
        publisher = output.advertise()

        def publish(effect: Effect) -> None:
            if isinstance(effect, OrderAnnounced):
                publisher.publish(order_message(effect.order))

        self._cell.competition.on_effect.append(publish)

    def tray_contents(self, output: Output) -> None:
        """Contents of each tray, at each of its reports."""
        publisher = output.advertise()

        def publish(tray: KitTray) -> None:
            if publisher.listeners:
                publisher.publish(tray_message(tray.link, self._cell.competition.tray_objects(tray)))

        for tray in self._cell.trays.values():
            tray.on_report.append(publish)

    def silence(self, output: Output) -> None:
        """Publish nothing, in a competition."""
        output.advertise()

    def joint_states(self, output: Output) -> None:
        """Positions, velocities and efforts of the joints."""
        trial = self._cell.trial
        arm = of_arm(self._cell.arms, trial, output.row.subject)
        clock = arm.simulation.clock
        names = sorted(arm.joints)
        order = [arm.joints.index(name) for name in names]
        described = next(each for each in trial.arms if self._cell.arms[each.name] is arm)
        # the original's controller publishes the cup's joint as an extra one, at 0
        extra = [GRIPPER_JOINT] if described.tool.kind == "vacuum" else [*described.finger_joints]
        fingers = self._cell.grippers.get(described.name)
        still = [[0.0] * len(extra)] * 3

        def columns() -> list[list[float]]:
            more = fingers.joints() if isinstance(fingers, FingerGripper) else still
            return [
                [*(column[index] for index in order), *others] for column, others in zip(arm.read(), more, strict=True)
            ]

        sample_joints(output, [*names, *extra], columns, clock)

    def all_joint_states(self, output: Output) -> None:
        """Positions, velocities and efforts of the joints of all arms, by their names in the robot description."""
        clock = self._cell.simulation.clock
        names: list[str] = []
        reads: list[Callable[[], Sequence[Sequence[float]]]] = []
        for each in self._cell.trial.arms:
            arm, gripper = self._cell.arms[each.name], self._cell.grippers.get(each.name)
            own = (*arm.joints, *each.finger_joints)
            names += [each.frame_prefix + name.removeprefix(each.joint_prefix) for name in own]
            reads.append(arm.read)
            if isinstance(gripper, FingerGripper):
                reads.append(gripper.joints)

        def columns() -> list[list[float]]:
            readings = [read() for read in reads]
            return [[value for each in column for value in each] for column in zip(*readings, strict=True)]

        sample_joints(output, names, columns, clock)

    def arm_state(self, output: Output) -> None:
        """Desired and actual state of the joints."""
        sample_following(output, of_arm(self._cell.arms, self._cell.trial, output.row.subject))

    def gripper_state(self, output: Output) -> None:
        """State of the suction or the fingers, and whether the gripper holds something."""
        gripper = of_arm(self._cell.grippers, self._cell.trial, output.row.subject)
        make, encode = made_once(osrf_gear.VacuumGripperState, output)
        output.sample(
            lambda: make(gripper.enabled, gripper.attached), lambda: encode(gripper.enabled, gripper.attached)
        )

    def agv_state(self, output: Output) -> None:
        """State of an AGV or of a fixed tray."""
        sender = self._cell.senders[output.row.subject or ""]
        make, encode = made_once(String, output)
        output.sample(lambda: make(sender.state), lambda: encode(sender.state))

    def population_state(self, output: Output) -> None:
        """State of the flow of parts onto a belt."""
        population = named(self._cell.populations, output.row.subject)
        make, encode = made_once(osrf_gear.PopulationState, output)
        output.sample(lambda: make(population.running), lambda: encode(population.running))

    def _sensor(self, output: Output) -> Any:
        return self._cell.sensors[output.row.subject or ""]

    def _stream(self, output: Output, message: Callable[[Any, Any], Message]) -> None:
        sensor = self._sensor(output)
        output.stream(sensor.listen, lambda reading: message(reading, sensor))

    break_beam = partialmethod(_stream, message=beam_message)

    def _ranges(self, output: Output, message: Callable[[Any, Any], Message], field: str) -> None:
        """Stream the ranges of a sensor, all else in whose messages stays."""
        sensor = self._sensor(output)
        templates = CdrTemplates(output.bus.types, (field,))

        def build(reading: Any) -> Message:
            return message(reading, sensor)

        def encode(reading: Any) -> bytes:
            return templates.filled(None, partial(build, reading), reading.time_ns, getattr(reading, field))

        output.stream(sensor.listen, build, encode=encode)

    proximity_sensor = partialmethod(_ranges, message=range_message, field="range")
    laser_profiler = partialmethod(_ranges, message=scan_message, field="ranges")

    def break_beam_change(self, output: Output) -> None:
        """Readings of a break beam that differ from the previous one."""
        beam = self._sensor(output)
        output.stream(beam.listen_changes, lambda reading: beam_message(reading, beam))

    def logical_camera(self, output: Output) -> None:
        """Images of a logical camera."""
        self._images(output, self._sensor(output))

    def quality_control_image(self, output: Output) -> None:
        """Images of a quality control sensor."""
        self._images(output, self._cell.quality[int(output.row.subject or 0)])

    def _images(self, output: Output, camera: LogicalCamera) -> None:
        templates = CdrTemplates(output.bus.types, POSE_FIELDS)

        def encode(reading: CameraReading) -> bytes:
            seen = reading.detections
            numbers = pose_numbers([*(each.camera_T_model for each in seen), reading.world_T_camera])
            shape = tuple(each.type for each in seen)
            return templates.filled(shape, partial(image_message, reading), reading.time_ns, numbers)

        output.stream(camera.listen, image_message, encode=encode, is_deferred=True)

    def _picture(self, output: Output, message: _PictureMessage, *, colour: bool = False, depth: bool = False) -> None:
        camera = self._sensor(output)
        listen = partial(camera.look, colour=colour and camera.description.has_colour, depth=depth)
        output.stream(listen, lambda picture: message(picture, camera))

    colour_picture = partialmethod(_picture, message=pictures.colour_message, colour=True)
    depth_picture = partialmethod(_picture, message=pictures.depth_message, depth=True)
    camera_info = partialmethod(_picture, message=pictures.info_message)
    depth_points = partialmethod(_picture, message=pictures.points_message, colour=True, depth=True)
    point_cloud = partialmethod(_picture, message=pictures.cloud_message, depth=True)
