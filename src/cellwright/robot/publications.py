"""Published topics of the robot's node: clock, joint states, gripper states, status, and camera images."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial, partialmethod

import numpy as np

from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import RobotModel
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import Output, publish_clock
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.middleware.messages.conversions import header, joint_state
from cellwright.middleware.messages.standard import JointState
from cellwright.rendering.cameras import interface as pictures
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera
from cellwright.rendering.cameras.render_service import RenderService
from cellwright.robot.commander import Commander
from cellwright.robot.grippers import GripperRange
from cellwright.robot.model import body_of
from cellwright.robot.servos import as_slice

STATUS_PERIOD = Fraction(1, 10)
"""Minimum time between two messages [s]."""


def add_cameras(
    config: RobotConfig,
    simulation: Simulation,
    service: RenderService,
    report: Callable[[str], None] = lambda _line: None,
    *,
    prefix: str = "",
    frame_prefix: str = "",
) -> dict[str, PictureCamera]:
    """Add the cameras of a robot, by name; one that cannot be made is reported and left out.

    The `prefix` is that of the robot's bodies in the engine; its cameras have it too, as devices. The `frame_prefix` is
    that of the frames of their pictures.
    """
    found: dict[str, PictureCamera] = {}
    for name, description in picture_cameras(config, report).items():
        frame = prefix + description.frame if prefix else body_of(description.frame)
        camera = PictureCamera(replace(description, name=prefix + name, frame=frame), service, report=report)
        camera.optical_frame = f"{frame_prefix}{name}_optical_frame"
        simulation.add(camera)
        found[name] = camera
    return found


class CameraTopics:
    """Handlers of the picture topics, with stamps by `message_time` [ns]; pictures are made only for subscribers."""

    def __init__(self, cameras: dict[str, PictureCamera], message_time: Callable[[], int]) -> None:
        self._cameras, self._message_time = cameras, message_time

    def _stream(
        self,
        output: Output,
        make: Callable[[Picture, PictureCamera], Message | None],
        *,
        colour: bool = False,
        depth: bool = False,
    ) -> None:
        camera = self._cameras[output.row.subject or ""]

        def build(picture: Picture) -> Message | None:
            age = camera.simulation.clock.message_time() - picture.time_ns
            return make(replace(picture, time_ns=max(0, self._message_time() - age)), camera)

        output.stream(partial(camera.look, colour=colour, depth=depth), build)

    colour_picture = partialmethod(_stream, make=pictures.colour_message, colour=True)
    depth_picture = partialmethod(_stream, make=pictures.depth_message, depth=True)
    camera_info = partialmethod(_stream, make=pictures.info_message)


class StatusTopic(Device):
    """Publisher of the status; a late subscriber gets the newest message.

    It counts input since the process began, which is no state: it is published again after a restore.
    """

    def __init__(self, output: Output, commander: Commander) -> None:
        name = output.row.name
        super().__init__(name)
        self._bus, self._commander = output.bus, commander
        self._publisher = output.advertise()
        self._publisher.is_state = False
        output.simulation.watch(name, STATUS_PERIOD, self._publish, output.rank)

    def reset(self) -> None:
        """Begin a run, without the newest message of the last one."""
        self._publisher.forget()

    def set_state(self, state: State) -> None:
        """Continue from a saved state, as at the beginning of a run."""
        super().set_state(state)
        self.reset()

    def _publish(self, _index: int) -> None:
        status = status_of(self._commander, self._bus)
        if status != self._publisher.newest:
            self._publisher.publish(status)


def status_of(commander: Commander, bus: Bus) -> TeleopStatus:
    """Return the current status."""
    return TeleopStatus(
        enabled=commander.is_enabled,
        emergency_stop=commander.is_stopped,
        resetting=commander.is_homing,
        silent=commander.watchdog.is_all_silent,
        commander=", ".join(commander.gate.commanders),
        taken=commander.taken,
        refused=bus.refusals.total,
        ignored=commander.ignored,
        unknown_names=list(commander.notices.unknown),
        message=_status_message(commander),
    )


def _status_message(commander: Commander) -> str:
    """Return the reason why commands are not followed, or the nodes that send them."""
    if commander.is_stopped:
        return f"{commander.why_held}; {commander.how_to_clear}"
    if not commander.is_enabled:
        return commander.why_ignored
    if commander.is_homing:
        return "on its way home; commands are ignored meanwhile"
    if commander.watchdog.topics:
        return f"joints are held: no message on {', '.join(commander.watchdog.topics)}"
    if commander.why_held:
        return commander.why_held
    commanders = commander.gate.commanders
    return f"follows {', '.join(commanders)}" if commanders else "waits for commands"


class RobotPublications:
    """Handlers of the other published topics, with stamps by `message_time` [ns]; grippers are right, left."""

    def __init__(
        self, robot: RobotModel, commander: Commander, grippers: Sequence[GripperRange], message_time: Callable[[], int]
    ) -> None:
        self._driver = driver = commander.driver
        self._commander, self._grippers, self._message_time = commander, tuple(grippers), message_time
        self._names = [joint.name for joint in robot.movable]
        self._places = as_slice(np.array([self._names.index(name) for name in driver.joints], dtype=np.intp))
        self._driven = list(driver.joints)
        self._gripper_names = [f"gripper_{number}" for number in range(len(self._grippers))]

    clock = staticmethod(publish_clock)

    def status(self, output: Output) -> None:
        """Publish whether commands are taken, and whose."""
        output.simulation.add(StatusTopic(output, self._commander))

    def joint_states(self, output: Output) -> None:
        """Publish the state of all joints that are not fixed; 0 for joints of more than one degree of freedom."""

        def build() -> Message:
            columns = np.zeros((3, len(self._names)))
            for column, values in zip(columns, self._driver.read(), strict=True):
                column[self._places] = values
            columns += 0.0  # turns -0.0 into 0.0
            columns.flags.writeable = False
            return JointState(header(time=self._message_time()), list(self._names), *columns)

        output.sample(build)

    def applied_targets(self, output: Output) -> None:
        """Publish the targets that the joints really follow."""
        output.sample(lambda: joint_state(self._driven, self._commander.applied, time=self._message_time()))

    def gripper_states(self, output: Output) -> None:
        """Publish how far each gripper is closed."""

        def build() -> Message:
            positions = self._driver.read().positions
            statuses = [gripper.status(positions) for gripper in self._grippers]
            return joint_state(self._gripper_names, statuses, time=self._message_time())

        output.sample(build)
