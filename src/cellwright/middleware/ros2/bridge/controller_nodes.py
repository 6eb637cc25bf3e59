"""Nodes of ros2_control beside that of a cell: the controller manager with its services, and the arm's controller.

A cell is asked for them once; a robot has none, since a program's own controller manager drives it. Without the package
`controller_manager_msgs` the nodes have parameters alone; of an older package the services that it has.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from cellwright.middleware.ros2.bridge.interfaces import fill
from cellwright.middleware.ros2.bridge.node import RosNode, quality
from cellwright.middleware.ros2.bridge.parameters import flat
from cellwright.middleware.ros2.bridge.services import CellCalls
from cellwright.middleware.ros2.bridge.standard_services import ServerServices, in_lower_case
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog
from cellwright.middleware.wire.frames import Frame

CONTROLLERS, NODES, ACTIVITY = "controllers/", "controllers/Nodes", "controllers/Activity"
"""Prefix of the services on the server; those of the nodes' parameters and of the states of controllers."""

MANAGER, PACKAGE = "controller_manager", "controller_manager_msgs"
SERVICES = (
    *("ListControllers", "ListControllerTypes", "ListHardwareComponents", "ListHardwareInterfaces"),
    *("SwitchController", "LoadController", "ConfigureController", "CleanupController", "UnloadController"),
    *("ReloadControllerLibraries", "SetHardwareComponentState"),
)
"""Services of a controller manager."""


class ControllerNodes:
    """The nodes. `nodes` and `activity` are the cell's answers to the services NODES and ACTIVITY."""

    def __init__(
        self, ros: RosNode, loop: EventLoop, calls: CellCalls, nodes: Mapping[str, Any], activity: Mapping[str, Any]
    ) -> None:
        made = {name: ros.add_node(name) for name in nodes}
        for name, node in made.items():
            _declare(node, nodes[name])
        with contextlib.suppress(ImportError):
            self._services = _ManagerServices(ros, loop, calls, made[MANAGER])
        with contextlib.suppress(ImportError, AttributeError):
            self._publish(made[MANAGER], activity)

    def _publish(self, manager: Any, activity: Mapping[str, Any]) -> None:
        """Publish once the states of controllers and hardware, which never change."""
        kind = import_module(f"{PACKAGE}.msg").ControllerManagerActivity
        latched = quality(is_reliable=True, is_transient_local=True, depth=1)
        self._activity = manager.create_publisher(kind, "~/activity", latched)
        message = fill(kind(), dict(activity))
        message.header.stamp = manager.get_clock().now().to_msg()
        self._activity.publish(message)


class _ManagerServices(ServerServices):
    """Services of the controller manager; a refusal is also reported, since most responses have no reason."""

    def __init__(self, ros: RosNode, loop: EventLoop, calls: CellCalls, node: Any) -> None:
        self._ros = ros
        self._reasons: dict[str, str] = {}
        """Newest reason by service."""
        self._refusals = ThrottledLog(loop, "{subject} {count}", self._say)
        super().__init__(ros, calls, PACKAGE, CONTROLLERS, SERVICES, _not_ok, node)

    def ask(self, name: str, request: Mapping[str, Any], answered: Callable[[dict[str, Any]], object]) -> None:
        """Call a service; `answered` gets the values of the response."""

        def heard(values: dict[str, Any]) -> None:
            if not values.get("ok", True):
                service = f"{MANAGER}/{in_lower_case(name)}"
                self._reasons[service] = values["message"]
                self._refusals.count(service)
            answered(values)

        super().ask(name, request, heard)

    def _say(self, line: str) -> None:
        service, _, count = line.partition(" ")
        self._ros.say(f"refused {service}{'' if count == '1' else f' ({count} times)'}: {self._reasons[service]}")


def _declare(node: Any, values: dict[str, Any]) -> None:
    """Declare read-only parameters; `use_sim_time`, which rclpy lets anyone set, cannot be set either."""
    for name, value in flat(values):
        node.declare_parameter(name, value, ParameterDescriptor(read_only=True))
    node.add_on_set_parameters_callback(
        lambda _parameters: SetParametersResult(successful=False, reason="parameters of this node are read-only")
    )


def _not_ok(refused: Frame) -> dict[str, Any]:
    return {"ok": False, "message": " ".join(refused.text().split())}
