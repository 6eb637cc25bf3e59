"""A client of the kit-building cell: its orders, arm, gripper, AGVs and sensors by name."""

import contextlib
import logging
import math
from collections.abc import Callable
from typing import Any

from cellwright.clients.client.arm import ClientArm
from cellwright.clients.client.description import CellDescription
from cellwright.clients.client.in_process import Transport
from cellwright.clients.client.pictures import LatestPicture, picture_topics
from cellwright.clients.client.session import Latest
from cellwright.middleware.messages import osrf_gear
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.middleware.messages.standard import String
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.util.errors import CellwrightError, UnknownNameError

AWAKE = 0.05
"""Time [s] before the end of `idle` at which the client listens again: joint states come every 0.02 s."""

_PREFIX = "/ariac/"
_STATUS_TOPIC = "/cellwright/intention"
_NO_SENSORS = ("competition_state", "current_score", "joint_states", "orders", "trays")

log = logging.getLogger(__name__)


class Client(CellDescription, ClientArm):
    """Client of the kit-building cell, and of its arm if it has one. `arm` returns one of several.

    It subscribes from the start to the competition's state, orders, score, joint states and the gripper. The
    first call that reads a sensor subscribes to it.

    Example:
        >>> from cellwright import Cell, Client, Trial
        >>> client = Client.in_process(Cell(Trial("one arm", has_arm=True)))
        >>> client.move_arm([(1.5, 0.25, -1.1, 3.1, 3.7, -1.5, 0.0)], times=[0.5])
        True
        >>> round(client.joint_positions["linear_arm_actuator_joint"], 2)
        0.25
    """

    def __init__(self, transport: Transport) -> None:
        CellDescription.__init__(self, transport)
        self.orders: list[osrf_gear.Order] = []
        """Every order announced so far (osrf_gear/Order), in order of announcement."""
        self._state = self.latest("/ariac/competition_state")
        self._score = self.latest("/ariac/current_score")
        ClientArm.__init__(self, self, _PREFIX.rstrip("/"))
        self._arms: dict[str, ClientArm] = {}
        self._sensors: dict[str, Latest] = {}
        self._cameras: dict[str, LatestPicture] = {}
        self.subscribe("/ariac/orders", self.orders.append, passive=True)

    def remember(self) -> object:
        """Return what it has received; see `NodeClient.remember`."""
        return super().remember(), tuple(self.orders)

    def forget(self) -> None:
        """Forget what it has received, the orders too."""
        super().forget()
        self.orders.clear()

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned."""
        received, orders = memory
        super().recall(received)
        self.orders[:] = orders

    @property
    def competition_state(self) -> str:
        """Newest state: `init`, `ready`, `go`, `end_game` or `done`; empty before the first message."""
        return "" if self._state.message is None else str(self._state.message.data)

    @property
    def score(self) -> float:
        """Newest score; 0 before the first message."""
        return 0.0 if self._score.message is None else float(self._score.message.data)

    def start_competition(self) -> bool:
        """Start the competition; False if it had been started before."""
        return self._trigger("/ariac/start_competition")

    def end_competition(self) -> bool:
        """End the competition now, with the score as it stands."""
        return self._trigger("/ariac/end_competition")

    def wait_for_order(self, timeout: float | None = None) -> osrf_gear.Order | None:
        """Wait for the next order to be announced (osrf_gear/Order); None if none comes within `timeout` [s]."""
        known = len(self.orders)
        return self.orders[known] if self.wait_until(lambda: len(self.orders) > known, timeout) else None

    def material_locations(self, material: str) -> tuple[str, ...]:
        """Return the places of a type's parts, such as `bin7` or `belt`; none for an unknown type."""
        request = osrf_gear.GetMaterialLocationsRequest(material_type=material)
        return tuple(unit.unit_id for unit in self.call("/ariac/material_locations", request).storage_units)

    def set_status(self, text: str) -> None:
        """Announce the next action in a line, for the viewer's panel and recordings.

        It changes nothing in the cell; a cell that ignores it raises no error.
        """
        with contextlib.suppress(CellwrightError):  # a cell of another make, say
            self.publish(_STATUS_TOPIC, String(text))

    def arm(self, namespace: str) -> ClientArm:
        """Return an arm with its gripper by its namespace, which is the arm's name unless the cell says otherwise.

        The first call for an arm subscribes to its joint states and its gripper.

        Raises:
            UnknownNameError: there is no such arm. In ROS, where one may appear later, that is only logged.
        """
        if namespace not in self._arms:
            ends = (each.removeprefix(_PREFIX).partition("/arm/state") for each in self.transport.topics())
            arms = sorted(name for name, found, rest in ends if found and not rest)
            if namespace not in arms:
                self._report(UnknownNameError("arm", namespace, arms))
            self._arms[namespace] = ClientArm(self, f"{_PREFIX}{namespace}")
        return self._arms[namespace]

    def idle(self, duration: float) -> None:
        """Let `duration` seconds pass without joint states and gripper.

        As `sleep`, but unsubscribed from both until shortly before the end, which costs the cell less: the gripper
        publishes its state in every step. At the end both are as new as after `sleep`; callbacks in between see their
        old values.

        Raises:
            UsageError: called from a callback or another thread, or with a negative or non-finite duration.
            RunEndedError: the run is over.
        """
        self._refuse_nesting()  # before any subscription ends
        # over ROS each subscription would need a new connection
        if not AWAKE < duration < math.inf or not self.transport.knows_all_topics:
            self.sleep(duration)
            return
        end = self.transport.now() + round(duration * NANOSECONDS)
        arms: list[ClientArm] = [self, *self._arms.values()]
        paused = [each for arm in arms for each in (arm.joint_states, arm.gripper)]
        for each in paused:
            each.cancel()
        try:
            self._advance(end - round(AWAKE * NANOSECONDS), None)
        finally:
            for each in paused:
                each.listen()
        counts = [each.count for each in paused]
        self._advance(end, None)
        for each, count in zip(paused, counts, strict=True):
            if each.count == count and each.message is not None:  # a cell that runs ahead of its clients
                each.wait_for_next(1.0)

    def control_agv(self, agv: int | str, kit_type: str) -> bool:
        """Send an AGV, by number or name, away as a kit such as `order_0_kit_0`; False unless it is ready.

        The name of a fixed tray submits that.

        Raises:
            UnknownNameError: the cell has no such AGV or tray.
        """
        request = osrf_gear.AGVControlRequest(kit_type=kit_type)
        return bool(self.call(f"/ariac/agv{agv}" if isinstance(agv, int) else f"/ariac/{agv}", request).success)

    def sensor(self, name: str) -> Latest:
        """Return the newest reading of a sensor of the trial; the first call subscribes.

        The `message` of an `rgb_camera` or an `rgbd_camera` is a `CameraPicture`, as of `camera`. That of a
        `depth_camera` is a sensor_msgs/PointCloud, as in 2018; `camera` has its depths.

        Raises:
            UnknownNameError: there is no such sensor. In ROS, where one may appear later, that is only logged.
        """
        if name not in self._sensors:
            pictures = self._picture_topics(name)
            self._sensors[name] = self.camera(name) if pictures else self.latest(self._sensor_topic(name))
        return self._sensors[name]

    def camera(self, name: str) -> LatestPicture:
        """Return the newest picture of a camera of the trial, as arrays; the first call subscribes.

        A picture comes with all that the camera sees, colours and depths of one moment.

        Raises:
            UnknownNameError: there is no such camera.
        """
        if name not in self._cameras:
            topics = picture_topics(f"{_PREFIX}{name}", self.transport.topics())
            if not topics:
                published = self.transport.topics()
                below = sorted({each.split("/")[2] for each in published if each.startswith(_PREFIX)})
                cameras = [each for each in below if picture_topics(f"{_PREFIX}{each}", published)]
                raise UnknownNameError("camera", name, cameras)
            self._cameras[name] = LatestPicture(self, f"{_PREFIX}{name}", topics)
        return self._cameras[name]

    def on_sensor(self, name: str, callback: Callable[[Any], None]) -> Callable[[], None]:
        """Call `callback(message)` for each reading of a sensor: messages as of `sensor`.

        Returns:
            A function that ends the subscription.

        Raises:
            UnknownNameError: as for `sensor`.
        """
        if topics := self._picture_topics(name):
            return LatestPicture(self, f"{_PREFIX}{name}", topics, callback).cancel
        return self.subscribe(self._sensor_topic(name), callback)

    def _picture_topics(self, name: str) -> dict[str, str]:
        """Return the topics of a camera whose pictures are its readings; empty for any other sensor."""
        topics = self.transport.topics()
        return {} if f"{_PREFIX}{name}" in topics else picture_topics(f"{_PREFIX}{name}", topics)

    def _sensor_topic(self, name: str) -> str:
        """Return the topic of a sensor, which must exist."""
        topic, topics = f"{_PREFIX}{name}", self.transport.topics()
        if topic not in topics:
            below = [each.removeprefix(_PREFIX) for each in topics if each.startswith(_PREFIX)]
            plain = {each for each in below if "/" not in each and each not in _NO_SENSORS}
            firsts = {each.partition("/")[0] for each in below}
            sensors = sorted(plain | {each for each in firsts if picture_topics(f"{_PREFIX}{each}", topics)})
            self._report(UnknownNameError("sensor", name, sensors))
        return topic

    def _report(self, error: UnknownNameError) -> None:
        """Raise an error, or log it where the topic may appear later."""
        if self.transport.knows_all_topics:
            raise error
        log.warning("%s; waiting for it", error)

    def _trigger(self, service: str) -> bool:
        return bool(self.call(service, TriggerRequest()).success)
