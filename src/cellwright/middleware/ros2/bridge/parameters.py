"""Parameters of the bridge's node: the cell's own, which are read-only, and `speed`, which sets the pace of time."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult

from cellwright.middleware.ros2.bridge.node import RosNode
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.frames import Frame, FrameKind

PARAMETERS, CONTROL = "cellwright/parameters", "cellwright/control"
SPEED, USE_SIM_TIME = "speed", "use_sim_time"
UNLIMITED = 0.0
"""Value of `speed` while time passes as fast as it goes."""
MAX_SPEED = 1000.0
_TIMEOUT = 2.0  # for the cell to answer [s]


class NodeParameters:
    """Parameters of the node. `values` are the cell's, nested as on the parameter server of ROS 1."""

    def __init__(self, ros: RosNode, link: LinkClient, values: dict[str, Any], speed: object) -> None:
        self._link = link
        self._node = node = ros.node
        self._before = set(node.get_parameters_by_prefix(""))
        read_only = ParameterDescriptor(read_only=True)
        for name, value in flat(values):
            if name != USE_SIM_TIME and not node.has_parameter(name):
                node.declare_parameter(name, value, read_only)
        node.add_on_set_parameters_callback(self._set)
        if isinstance(speed, (int, float, str)):
            described = ParameterDescriptor(
                description="simulated seconds in a second; 0: as fast as it goes",
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=MAX_SPEED)],
            )
            self._is_declared = False
            node.declare_parameter(SPEED, UNLIMITED if isinstance(speed, str) else float(speed), described)
        self._is_declared = True

    def withdraw(self) -> None:
        """Remove the parameters, for those of another cell."""
        self._node.remove_on_set_parameters_callback(self._set)
        for name in set(self._node.get_parameters_by_prefix("")) - self._before:
            self._node.describe_parameter(name).read_only = False  # else it could not be removed
            self._node.undeclare_parameter(name)

    def _set(self, parameters: list[Any]) -> SetParametersResult:
        """Set the speed at the cell, which may refuse it, as in a competition."""
        for parameter in parameters:
            # rclpy declares it, and lets anyone set it.
            if parameter.name == USE_SIM_TIME:
                return SetParametersResult(successful=False, reason="use_sim_time is read-only")
            if parameter.name != SPEED or not self._is_declared:
                continue
            factor = "max" if parameter.value == UNLIMITED else parameter.value
            answer = self._ask({"action": "speed", "factor": factor})
            if answer is None or answer.kind is not FrameKind.ANSWER:
                reason = "the cell does not answer" if answer is None else answer.text()
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _ask(self, request: dict[str, Any]) -> Frame | None:
        found: list[Frame] = []
        has_answered = threading.Event()

        def answered(frame: Frame) -> None:
            found.append(frame)
            has_answered.set()

        self._link.request(FrameKind.CALL, answered, name=CONTROL, payload=json.dumps(request).encode())
        return found[0] if has_answered.wait(_TIMEOUT) else None


def flat(values: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the parameters in nested dictionaries, with dots between the names; what ROS 2 cannot hold is left out."""
    for name, value in values.items():
        path = f"{prefix}{name.strip('/').replace('/', '.')}"
        if isinstance(value, dict):
            yield from flat(value, f"{path}.")
        elif isinstance(value, (bool, int, float, str)):
            yield path, value
        elif isinstance(value, (list, tuple)) and value:
            kinds = {type(each) for each in value}
            if kinds <= {int, float} and float in kinds:
                yield path, [float(each) for each in value]
            elif len(kinds) == 1 and kinds <= {bool, int, str}:
                yield path, list(value)


def description_of(values: dict[str, Any]) -> str:
    """Return the robot's description in URDF among parameters; empty for none."""
    return next((str(value) for name, value in flat(values) if name.rpartition(".")[2] == "robot_description"), "")
